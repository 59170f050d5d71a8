// SPDX-License-Identifier: GPL-2.0-or-later
//
// Handles SIGINT, SIGTERM and SIGHUP so that a run can end in order; signals also interrupt waits.

#ifndef STAGE_TOOLS_STAGE_INTERRUPT_HH
#define STAGE_TOOLS_STAGE_INTERRUPT_HH

#include "threads/wall_clock.hh"

namespace Stg::program {

using threads::WallClock;

/// Installs the handlers. The first SIGINT or SIGTERM is only recorded; a second one of the same
/// kind kills the process. SIGHUP is always only recorded.
void CatchSignals();
/// Sets an async-signal-safe function that the handler calls after recording a signal.
void OnSignal(void (*action)());
/// The recorded signal; 0: none.
int CaughtSignal();
/// Sleeps until WallClock() is `time`. Returns false immediately if a signal was caught.
bool SleepUntil(double time);
/// Terminates the process by the signal's default action, so that the calling shell sees it.
/// Returns an exit status if that is impossible.
int RaiseDefault(int signal);

}  // namespace Stg::program

#endif
