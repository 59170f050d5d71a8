// SPDX-License-Identifier: GPL-2.0-or-later
//
// Python's global interpreter lock (GIL), and threads that still work when the program ends.
//
// Python ends a daemon thread that wants the GIL back after the main thread has finished: up to
// Python 3.13 by unwinding its stack, which aborts the process as soon as it comes to a destructor.
// So no thread asks for the GIL once the program ends. It is parked instead, as Python 3.14 does by
// itself, and the main thread waits for threads that are at work to come to that point.

#ifndef STAGE_PYTHON_GIL_HH
#define STAGE_PYTHON_GIL_HH

#include <nanobind/nanobind.h>

namespace Stg::python {

/// Releases the GIL for as long as it lives. At its end the thread is parked for ever if the
/// program is ending and another thread ends it.
class GilRelease {
 public:
  GilRelease() noexcept;
  ~GilRelease();
  GilRelease(const GilRelease&) = delete;
  GilRelease& operator=(const GilRelease&) = delete;

  /// To be called between the parts of long work, by a thread that has a GilRelease: parks it if
  /// the program is ending and another thread ends it.
  static void ParkIfEnding() noexcept;

 private:
  PyThreadState* state_;
};

/// Has Python call, when it ends, what makes threads park.
void ParkThreadsAtExit();

}  // namespace Stg::python

#endif
