// SPDX-License-Identifier: GPL-2.0-or-later
//
// Watches the drivers while the process uses OpenCL. If a driver crashes, ends the process or
// hangs, the process cannot be saved; but one line tells the user which driver it was, in which
// call, and how to run without it.

#ifndef STAGE_CL_DRIVER_WATCH_HH
#define STAGE_CL_DRIVER_WATCH_HH

namespace Stg::cl {

/// Drivers are watched while at least one object of this class exists.
///
/// A crash signal goes to the previous handler after the line was printed: the process ends by the
/// signal and may dump core. A call that exceeds STAGE_CL_TIMEOUT ends the process with status 1.
class DriverWatch {
 public:
  /// `seconds` is the time limit per call; 0 means no limit.
  explicit DriverWatch(unsigned seconds);
  ~DriverWatch();
  DriverWatch(const DriverWatch&) = delete;
  DriverWatch& operator=(const DriverWatch&) = delete;
};

/// Use it, within a DriverWatch, while a driver is set up. Compilers in drivers then replace our
/// signal handlers by their own; ours are restored after each call.
class SetUpWatch {
 public:
  SetUpWatch();
  ~SetUpWatch();
  SetUpWatch(const SetUpWatch&) = delete;
  SetUpWatch& operator=(const SetUpWatch&) = delete;
};

}  // namespace Stg::cl

#endif
