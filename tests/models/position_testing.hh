// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_POSITION_TESTING_HH
#define STAGE_TESTS_POSITION_TESTING_HH

#include <limits>
#include <memory>
#include <string>

#include "support/model_testing.hh"

/// Helpers for tests of the position model.
namespace Stg {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A world with a subscribed robot "r".
struct Robot {
  explicit Robot(const std::string& properties, const std::string& rest = "")
      : world(LoadText("position( name \"r\" " + properties + " )\n" + rest)),
        position(FindRunning<ModelPosition>(*world, "r")) {}
  std::unique_ptr<World> world;
  ModelPosition* position;
};

}  // namespace Stg

#endif
