// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_MODEL_SEED_HH
#define STAGE_MODELS_MODEL_SEED_HH

#include <cstdint>
#include <string>

#include "random/fnv1a.hh"
#include "random/random.hh"

namespace Stg {

/// Seed of the random numbers of a model, which does not depend on names, as these may change:
/// `seed_above` is that of its parent, or of the world, and `count` the number of earlier children
/// of that type.
inline uint64_t SeedOfModel(uint64_t seed_above, const std::string& type, unsigned int count) {
  return MixSeeds(MixSeeds(seed_above, Fnv1a(type)), count);
}

/// Seed of the noise of a device. Models with the name of another one use their own seed as well.
inline uint64_t SeedOfNoise(uint64_t seed_of_world, uint64_t hash_of_name, bool shares_name,
                            uint64_t seed_of_model) {
  const uint64_t seed = seed_of_world ^ hash_of_name;
  return shares_name ? MixSeeds(seed, seed_of_model) : seed;
}

}  // namespace Stg

#endif
