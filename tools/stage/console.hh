// SPDX-License-Identifier: GPL-2.0-or-later
//
// Messages while the program runs. Standard output has only what options, or a world's show_clock,
// ask for, so that it can be piped into other programs. Warnings and errors go to standard error;
// so does what is being done (files that are loaded, remarks of controllers, the end), but only
// with a terminal, or with --progress.

#ifndef STAGE_PROGRAM_CONSOLE_HH
#define STAGE_PROGRAM_CONSOLE_HH

#include <optional>
#include <string>

namespace Stg::program {

/// Takes all messages of the library from now on. `all`: those about what is being done, too;
/// unset: only if standard error is a terminal.
void ShowMessages(std::optional<bool> all);
bool ShowsAll();
/// Prints a line about what is being done, if such lines are wanted.
void Say(const std::string& line);
/// Ends the line that goes on, such as that of the files that are loaded, if there is one.
void EndLine();
/// Ends the line of the clock, if there is one.
void EndClock();

}  // namespace Stg::program

#endif
