// SPDX-License-Identifier: GPL-2.0-or-later
//
// Console output during a run. Standard output only carries what options or a world's show_clock
// ask for, so that it can be piped into other programs. Warnings and errors go to standard error.
// So do progress messages (loaded files, remarks of controllers, the end), but only on a terminal
// or with --progress.

#ifndef STAGE_PROGRAM_CONSOLE_HH
#define STAGE_PROGRAM_CONSOLE_HH

#include <optional>
#include <string>

namespace Stg::program {

/// Routes all messages of the library here. `all` selects whether progress messages are shown;
/// unset: only if standard error is a terminal.
void ShowMessages(std::optional<bool> all);
bool ShowsAll();
/// Prints a progress message if progress is shown.
void PrintProgress(const std::string& line);
/// Ends an unfinished line on standard error, such as that of loaded files.
void EndLine();
/// Ends the line of the clock, if there is one.
void EndClock();

}  // namespace Stg::program

#endif
