// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the library says while the program runs, as users and their scripts know it: warnings and
// errors on standard error; what is being loaded, and the clock, on standard output, each in a line
// that goes on.

#ifndef STAGE_PROGRAM_CONSOLE_HH
#define STAGE_PROGRAM_CONSOLE_HH

namespace Stg::program {

/// From now on.
void ShowMessages();
/// Ends the line that is going on, if there is one.
void EndLine();

}  // namespace Stg::program

#endif
