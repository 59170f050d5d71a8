// SPDX-License-Identifier: GPL-2.0-or-later
//
// Handles Ctrl-C during long calls.

#ifndef STAGE_PYTHON_SIGNALS_HH
#define STAGE_PYTHON_SIGNALS_HH

#include <nanobind/nanobind.h>

#include "gil.hh"
#include "threads/wall_clock.hh"

namespace Stg::python {

/// Runs Python's signal handlers every 20 ms while a thread works without the GIL.
class SignalChecks {
 public:
  /// Call it often; it is cheap. Throws the exception that a handler raises, such as
  /// KeyboardInterrupt. Parks the thread if the program is exiting.
  void Poll() {
    GilRelease::ParkIfEnding();
    const double now = threads::WallClock();
    if (now < next_) return;
    const nanobind::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw nanobind::python_error();
    next_ = threads::WallClock() + kPeriod;
  }

 private:
  static constexpr double kPeriod = 0.02;  // seconds
  double next_ = threads::WallClock() + kPeriod;
};

}  // namespace Stg::python

#endif
