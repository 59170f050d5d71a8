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

/// Errors of the sensor of a ranger other than noise; see ModelRanger::Sensor.
struct RangeDefects {
  bool blind_near = false;
  double loss = 0;              // probability
  double step = 0;              // m; 0: none
  double least_cosine2 = 0;     // squared cosine of the steepest incidence with a return; 0: any
  double sine = 0, cosine = 1;  // of the angle between rays

  bool Any() const { return blind_near || loss > 0 || step > 0 || least_cosine2 > 0; }
};

/// `increment`: between rays, rad. `steepest`: incidence from the normal of a surface, rad.
RangeDefects MakeRangeDefects(bool blind_near, double loss, double step, double steepest,
                              double increment);

/// Adds noise and defects to ranges, keeping them between the sensor's minimum and maximum. Ranges
/// at the maximum are not measurements and stay unchanged. So do those below the minimum, unless
/// the sensor is blind there. A range that is lost becomes the maximum.
///
/// The incidence of a ray on a surface is that on the chord to the hit of the ray beside it, or the
/// less steep one of both sides: at the edge of a surface one side is another surface.
void AddRangeErrors(const RangeNoise& noise, const RangeDefects& defects, const Bounds& range,
                    RandomStream* random, double* to, size_t count);

}  // namespace Stg

#endif
