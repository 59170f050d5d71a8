// SPDX-License-Identifier: GPL-2.0-or-later
//
// Errors of sensors. Each sensor draws them from a stream of its own, seeded with the world's seed
// and its name (Model::NoiseSeed()), so that no other sensor and no thread has a say in them.

#ifndef STAGE_MODELS_NOISE_HH
#define STAGE_MODELS_NOISE_HH

#include <stdint.h>

#include <string>

#include "geometry/random.hh"

namespace Stg {

/// A number that depends on nothing but the text: FNV-1a.
inline uint64_t HashOf(const std::string& text) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

/// Uniform in [-1, 1).
inline double UniformError(RandomStream* random) { return random->Uniform(-1.0, 1.0); }

/// Normal, mean 0, variance 1: the sum of twelve uniform numbers (Irwin-Hall). It needs no
/// logarithm, which would differ in the last bit from one machine to the next.
inline double NormalError(RandomStream* random) {
  double sum = -6.0;
  for (int i = 0; i < 12; i++) sum += random->Uniform();
  return sum;
}

}  // namespace Stg

#endif
