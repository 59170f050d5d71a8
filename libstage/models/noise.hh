// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sensor noise. Each sensor draws it from its own stream, seeded with the world's seed and the
// sensor's name (Model::NoiseSeed()), so that neither other sensors nor threads affect it.

#ifndef STAGE_MODELS_NOISE_HH
#define STAGE_MODELS_NOISE_HH

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

}  // namespace Stg

#endif
