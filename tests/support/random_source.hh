// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random numbers for tests, with the same sequence on every machine.

#ifndef STAGE_TESTS_SUPPORT_RANDOM_SOURCE_HH
#define STAGE_TESTS_SUPPORT_RANDOM_SOURCE_HH

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace Stg::test {

/// The generator SplitMix64. It is independent of the library's generator, which is under test.
class RandomSource {
 public:
  explicit RandomSource(uint64_t seed) : state_(seed) {}

  uint64_t Next() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// A number in [low, high], including both ends.
  int64_t Between(int64_t low, int64_t high) {
    return low + static_cast<int64_t>(Next() % static_cast<uint64_t>(high - low + 1));
  }
  int Int(int low, int high) { return static_cast<int>(Between(low, high)); }
  double Real(double low, double high) {
    return low + (high - low) * (static_cast<double>(Next() >> 11) * 0x1p-53);
  }
  bool OneIn(uint64_t n) { return Next() % n == 0; }
  int Sign() { return OneIn(2) ? 1 : -1; }
  template <typename T>
  const T& Pick(const std::vector<T>& from) {
    return from[static_cast<size_t>(Next() % from.size())];
  }

 private:
  uint64_t state_;
};

}  // namespace Stg::test

#endif
