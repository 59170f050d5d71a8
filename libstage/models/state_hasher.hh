// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sums up the state of a world in one number, to compare runs. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_STATE_HASHER_HH
#define STAGE_MODELS_STATE_HASHER_HH

#include <stdint.h>
#include <string.h>

#include "geometry/geometry.hh"

namespace Stg {

/// FNV-1a over the bytes of numbers (http://www.isthe.com/chongo/tech/comp/fnv).
class StateHasher {
 public:
  StateHasher() : hash_(0xcbf29ce484222325u) {}

  /// -0 counts as 0. Whole numbers up to 2^53 are hashed without loss.
  void Add(double value) {
    unsigned char bytes[sizeof value];
    if (value == 0) value = 0;
    memcpy(bytes, &value, sizeof value);
    for (size_t i = 0; i < sizeof value; i++) hash_ = (hash_ ^ bytes[i]) * 0x100000001b3u;
  }
  void Add(const Pose& p) {
    Add(p.x);
    Add(p.y);
    Add(p.z);
    Add(p.a);
  }
  uint64_t hash() const { return hash_; }

 private:
  uint64_t hash_;
};

}  // namespace Stg

#endif
