// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_CL_ENVIRONMENT_HH
#define STAGE_CL_ENVIRONMENT_HH

#include <cstdlib>
#include <string>

namespace Stg::cl {

/// What a variable of the environment says; nothing if there is no such variable.
inline std::string FromEnvironment(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

}  // namespace Stg::cl

#endif
