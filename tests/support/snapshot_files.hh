// SPDX-License-Identifier: GPL-2.0-or-later
//
// Modifies snapshot files, see world/snapshot_file.cc.

#ifndef STAGE_TESTS_SUPPORT_SNAPSHOT_FILES_HH
#define STAGE_TESTS_SUPPORT_SNAPSHOT_FILES_HH

#include <cstddef>
#include <cstdint>
#include <string>

#include "random/fnv1a.hh"

namespace snapshot_files {

/// Sizes of the head before the state and of the checksum after it, bytes.
inline constexpr std::size_t kHead = 28, kChecksum = 8;

inline void Put(std::uint64_t number, std::size_t place, std::string* file) {
  for (std::size_t i = 0; i < 8; i++)
    (*file)[place + i] = static_cast<char>(number >> 8 * i & 0xff);
}

/// Corrects the size and the checksum of a file that is long enough for them.
inline std::string Signed(std::string file) {
  if (file.size() < kHead + kChecksum) return file;
  const std::size_t end = file.size() - kChecksum;
  Put(end - kHead, kHead - 8, &file);
  Put(Stg::Fnv1a(file.data(), end), end, &file);
  return file;
}

}  // namespace snapshot_files

#endif
