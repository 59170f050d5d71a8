// SPDX-License-Identifier: GPL-2.0-or-later
//
// The hash FNV-1a (http://www.isthe.com/chongo/tech/comp/fnv), which is the same on every machine.
// Part of <stage.hh>; C++11.

#ifndef STAGE_RANDOM_FNV1A_HH
#define STAGE_RANDOM_FNV1A_HH

#include <stddef.h>
#include <stdint.h>

#include <string>

namespace Stg {

constexpr uint64_t kFnv1aStart = 0xcbf29ce484222325u;  ///< hash of an empty sequence

/// Extends `hash` by a byte, or by any larger number.
constexpr uint64_t Fnv1aStep(uint64_t hash, uint64_t byte) {
  return (hash ^ byte) * 0x100000001b3u;
}

/// Hashes bytes. `before` is the hash of the bytes before them.
inline uint64_t Fnv1a(const void* bytes, size_t size, uint64_t before = kFnv1aStart) {
  const unsigned char* const first = static_cast<const unsigned char*>(bytes);
  for (size_t i = 0; i < size; i++) before = Fnv1aStep(before, first[i]);
  return before;
}

inline uint64_t Fnv1a(const std::string& text) { return Fnv1a(text.data(), text.size()); }

}  // namespace Stg

#endif
