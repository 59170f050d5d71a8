// SPDX-License-Identifier: GPL-2.0-or-later
//
// Watches the drivers while this process uses OpenCL. A driver that crashes, ends the process or
// doesn't come back can't be saved here; but the user is told, in one line, which driver it was, in
// which call, and how to go on without it.

#ifndef STAGE_CL_DRIVER_WATCH_HH
#define STAGE_CL_DRIVER_WATCH_HH

namespace Stg::cl {

/// Drivers are watched as long as there is one of these.
///
/// A signal of a crash goes on to whom it went before, once the line is out: the process ends by
/// it, and leaves a core dump where these are wanted. A call that takes longer than
/// STAGE_CL_TIMEOUT says ends the process with status 1.
class DriverWatch {
 public:
  /// `seconds`: that a call may take; 0: as long as it likes.
  explicit DriverWatch(unsigned seconds);
  ~DriverWatch();
  DriverWatch(const DriverWatch&) = delete;
  DriverWatch& operator=(const DriverWatch&) = delete;
};

/// While a driver is set up, within a DriverWatch. Compilers in drivers then put signal handlers of
/// their own in place of ours; these are put back after each call.
class SetUpWatch {
 public:
  SetUpWatch();
  ~SetUpWatch();
  SetUpWatch(const SetUpWatch&) = delete;
  SetUpWatch& operator=(const SetUpWatch&) = delete;
};

}  // namespace Stg::cl

#endif
