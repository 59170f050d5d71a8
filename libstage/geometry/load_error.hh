// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_GEOMETRY_LOAD_ERROR_HH
#define STAGE_GEOMETRY_LOAD_ERROR_HH

#include <stdexcept>
#include <string>

#include "messages/log.hh"

namespace Stg {

/// Bad input met while a world is loaded. what() is one line that terminals show as it is, in the
/// form `FILE:LINE:COLUMN: what was found, expected what` wherever there is a place to point at.
class LoadError : public std::runtime_error {
 public:
  explicit LoadError(const std::string& message, int exit_status = 1)
      : std::runtime_error(Printable(message)), exit_status_(exit_status) {}

  /// The status with which a program that cannot go on should end.
  int exit_status() const { return exit_status_; }

 private:
  int exit_status_;
};

}  // namespace Stg

#endif
