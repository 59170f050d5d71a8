// SPDX-License-Identifier: GPL-2.0-or-later
//
// An orderly end on SIGINT, SIGTERM and SIGHUP, and waiting that they cut short.

#ifndef STAGE_TOOLS_STAGE_INTERRUPT_HH
#define STAGE_TOOLS_STAGE_INTERRUPT_HH

namespace Stg::program {

/// Seconds since some fixed moment.
double Now();

/// From here on, the first SIGINT or SIGTERM is only noted; a second of the same kind kills. Any
/// SIGHUP is only noted.
void CatchSignals();
/// Called by the signal handler, with all that this forbids, after the signal was noted.
void OnSignal(void (*action)());
/// The signal that was noted; 0: none.
int CaughtSignal();
/// Sleeps until Now() is `time`. False, and at once, if a signal was caught.
bool SleepUntil(double time);
/// Ends the process by the signal, as if it had never been caught, so that the caller's shell sees
/// it. Returns the status to exit with where that is impossible.
int DieOf(int signal);

}  // namespace Stg::program

#endif
