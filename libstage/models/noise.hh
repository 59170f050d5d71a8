// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sensor noise. Each sensor draws it from its own stream, seeded with the world's seed and the
// sensor's name (Model::NoiseSeed()), so that neither other sensors nor threads affect it.

#ifndef STAGE_MODELS_NOISE_HH
#define STAGE_MODELS_NOISE_HH

#include <cmath>
#include <cstddef>

#include "geometry/geometry.hh"
#include "random/random.hh"

namespace Stg {

/// Uniformly distributed in [-1, 1).
inline double UniformError(RandomStream* random) { return random->Uniform(-1.0, 1.0); }

/// Approximately normal, mean 0, variance 1: the sum of twelve uniform numbers (Irwin-Hall). Avoids
/// logarithms, whose last bit differs between machines.
inline double NormalError(RandomStream* random) {
  double sum = -6.0;
  for (int i = 0; i < 12; i++) sum += random->Uniform();
  return sum;
}

/// Draws the constant relative errors of a robot's odometry, as Stage 4.3 does.
inline Velocity DrawOdomError(RandomStream* random) {
  constexpr double kWidth = 0.03, kWidthOfTurn = 0.05;  // of uniform distributions around 0
  const double x = random->Uniform(-kWidth / 2, kWidth / 2);
  const double y = random->Uniform(-kWidth / 2, kWidth / 2);
  const double a = random->Uniform(-kWidthOfTurn / 2, kWidthOfTurn / 2);
  return Velocity(x, y, 0, a);
}

/// Noise of the sensor of a ranger; see ModelRanger::Sensor.
struct RangeNoise {
  double variance = 0, fraction = 0, angle = 0;

  /// True if the headings of rays, which are `increment` apart, have errors.
  bool TurnsRays(double increment) const {
    return angle != 0 && increment != 0 && std::isfinite(angle);
  }
  bool Any(double increment) const {
    return TurnsRays(increment) || fraction != 0 || variance != 0;
  }
};

/// Adds noise, keeping ranges between the sensor's minimum and maximum. Ranges at the maximum or
/// below the minimum are not measurements and stay unchanged.
void AddRangeNoise(const RangeNoise& noise, const Bounds& range, RandomStream* random, double* to,
                   size_t count);

}  // namespace Stg

#endif
