// SPDX-License-Identifier: GPL-2.0-or-later
//
// Ctrl-C during long work.

#ifndef STAGE_PYTHON_SIGNALS_HH
#define STAGE_PYTHON_SIGNALS_HH

#include <nanobind/nanobind.h>

#include "gil.hh"
#include "threads/wall_clock.hh"

namespace Stg::python {

/// Lets Python handle its signals now and then while a thread works without the GIL.
class SignalChecks {
 public:
  /// To be called often. Throws what a handler has raised, such as KeyboardInterrupt. Parks the
  /// thread if the program is ending.
  void Look() {
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
