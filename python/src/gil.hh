// SPDX-License-Identifier: GPL-2.0-or-later
//
// Python's global interpreter lock (GIL), and threads that still work when the program exits.
//
// Python kills a daemon thread that asks for the GIL after the main thread has finished. Up to
// Python 3.13 it unwinds the thread's stack, which aborts the process at the first destructor.
// Therefore no thread asks for the GIL once the program exits: it parks instead, as in Python 3.14,
// and the main thread waits until the working threads have parked.

#ifndef STAGE_PYTHON_GIL_HH
#define STAGE_PYTHON_GIL_HH

#include <nanobind/nanobind.h>

namespace Stg::python {

/// Releases the GIL while the object lives. The destructor parks the thread forever if another
/// thread is ending the program.
class GilRelease {
 public:
  GilRelease() noexcept;
  ~GilRelease();
  GilRelease(const GilRelease&) = delete;
  GilRelease& operator=(const GilRelease&) = delete;

  /// Parks the calling thread, which must hold a GilRelease, if another thread is ending the
  /// program. Long loops call it regularly.
  static void ParkIfEnding() noexcept;

 private:
  PyThreadState* state_;
};

/// Registers the exit handler that makes threads park. Called once, when the module is loaded.
void ParkThreadsAtExit();

}  // namespace Stg::python

#endif
