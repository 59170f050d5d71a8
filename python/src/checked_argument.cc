// SPDX-License-Identifier: GPL-2.0-or-later

#include "checked_argument.hh"

#include "messages/report.hh"

namespace Stg::python {

void RefuseArgument(nb::handle value, const char* name, const char* expected) {
  const std::string text = nb::cast<std::string>(nb::repr(value));
  throw nb::type_error(
      ("found " + messages::Shortened(text) + " as " + name + ", expected " + expected).c_str());
}

}  // namespace Stg::python
