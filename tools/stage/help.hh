// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_HELP_HH
#define STAGE_TOOLS_STAGE_HELP_HH

#include <string>

namespace Stg::program {

/// The output of --help.
std::string HelpText();
/// Returns the lines of an option in help: `head`, and `text` in a column of its own. Lines of the
/// text that start with a blank are not wrapped.
std::string HelpEntry(const std::string& head, const std::string& text);

}  // namespace Stg::program

#endif
