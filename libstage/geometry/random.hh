// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_GEOMETRY_RANDOM_HH
#define STAGE_GEOMETRY_RANDOM_HH

#include <cstdint>

namespace Stg {

/// A small deterministic random number generator: the same seed gives the same numbers on every
/// machine. The generator is xoshiro256** 1.0 and its state is filled by splitmix64, both by
/// D. Blackman and S. Vigna (https://prng.di.unimi.it, public domain; "Scrambled Linear
/// Pseudorandom Number Generators", ACM TOMS 47(4), 2021). Not safe to share between threads.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed = 1) { Seed(seed); }

  void Seed(std::uint64_t seed);

  /// 64 random bits.
  std::uint64_t Next();

  /// In [0, 1), a multiple of 2^-53.
  double Uniform();

  /// In [lo, hi); lo where the interval is empty.
  double Uniform(double lo, double hi);

  /// The generator of this process, seeded with 1 at its first use.
  static RandomStream& Global();

 private:
  std::uint64_t state_[4];
};

}  // namespace Stg

#endif
