// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_FIDUCIAL_TESTING_HH
#define STAGE_TESTS_FIDUCIAL_TESTING_HH

#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "support/model_testing.hh"

/// Helpers for tests of fiducial finders.
namespace Stg {

using Fiducial = ModelFiducial::Fiducial;

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline std::string Number(double value) {
  char text[400];
  std::snprintf(text, sizeof text, "%.17f", value);
  return text;
}

/// A post with a height of 0.5 m.
inline std::string Target(const std::string& name, double x, double y, const std::string& more) {
  return "model( name \"" + name + "\" pose [" + Number(x) + " " + Number(y) +
         " 0 0] size [0.2 0.2 0.5] " + more + " )\n";
}

/// A world with a subscribed finder "f" at the origin.
struct Scene {
  explicit Scene(const std::string& rest, const std::string& properties = "")
      : world(LoadText("fiducial( name \"f\" " + properties + " )\n" + rest)),
        finder(FindRunning<ModelFiducial>(*world, "f")) {}
  const std::vector<Fiducial>& Found() {
    Step(*world);
    return finder->GetFiducials();
  }
  std::vector<int> Ids() {
    std::vector<int> ids;
    for (const Fiducial& f : Found()) ids.push_back(f.id);
    return ids;
  }
  std::unique_ptr<World> world;
  ModelFiducial* finder;
};

using Ids = std::vector<int>;

}  // namespace Stg

#endif
