// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_GEOMETRY_LOAD_ERROR_HH
#define STAGE_GEOMETRY_LOAD_ERROR_HH

#include <stdexcept>
#include <string>

#include "messages/log.hh"

namespace Stg {

/// Bad input while a world is loaded. what() is one printable line, of the form `FILE:LINE:COLUMN:
/// what was found, expected what` if there is a place to point at.
class LoadError : public std::runtime_error {
 public:
  explicit LoadError(const std::string& message, int exit_status = 1)
      : std::runtime_error(Printable(message)), exit_status_(exit_status) {}

  /// Exit status for a program that cannot continue.
  int exit_status() const { return exit_status_; }

 private:
  int exit_status_;
};

}  // namespace Stg

#endif
