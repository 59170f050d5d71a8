// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_RANGER_TESTING_HH
#define STAGE_TESTS_RANGER_TESTING_HH

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"

/// Helpers for tests of rangers.
namespace Stg {

using Sensor = ModelRanger::Sensor;

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline const char kBoxAhead[] =
    "model( name \"box\" pose [3 0 0 0] size [1 1 1] )\n";  // its face is at x = 2.5

/// A world with a subscribed ranger "l" at the origin, and models for it to see.
struct Scene {
  explicit Scene(const std::string& sensors, const std::string& rest = kBoxAhead,
                 const std::string& properties = "")
      : world(LoadText("ranger( name \"l\" " + properties + " " + sensors + " )\n" + rest)),
        ranger(FindRunning<ModelRanger>(*world, "l")) {}
  Sensor& sensor(size_t i = 0) { return ranger->GetSensorsMutable().at(i); }
  const std::vector<double>& Ranges() {
    Step(*world);
    return sensor().ranges;
  }
  std::unique_ptr<World> world;
  ModelRanger* ranger;
};

struct Moments {
  double mean = 0, deviation = 0, min = kInfinity, max = -kInfinity;
};
inline Moments MomentsOf(const std::vector<double>& values) {
  Moments m;
  double squares = 0;
  const double n = static_cast<double>(values.size());
  for (const double v : values) {
    m.mean += v / n;
    squares += v * v / n;
    m.min = std::min(m.min, v);
    m.max = std::max(m.max, v);
  }
  m.deviation = std::sqrt(squares - m.mean * m.mean);
  return m;
}

}  // namespace Stg

#endif
