// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/warn_about.hh"

#include <cstdarg>

#include "messages/report.hh"
#include "models/ancestor.hh"

namespace Stg {

void WarnAbout(const Ancestor& who, const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  const std::string text = messages::Formatted(format, arguments);
  va_end(arguments);
  messages::Warn(messages::Shortened(who.TokenStr()) + ": " + text);
}

}  // namespace Stg
