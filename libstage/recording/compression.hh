// SPDX-License-Identifier: GPL-2.0-or-later
//
// Chunks made smaller, by whichever libraries the program was built with.

#ifndef STAGE_RECORDING_COMPRESSION_HH
#define STAGE_RECORDING_COMPRESSION_HH

#include <memory>
#include <string>
#include <string_view>

#include "recording/buffer.hh"

namespace Stg::recording {

enum class Compression { kNone, kLz4, kZstd };

/// As MCAP calls them: "" for none, "lz4", "zstd".
const char* NameOf(Compression compression);
bool IsAvailable(Compression compression);
/// What logs take unless something else is asked for: the fastest there is.
Compression UsualCompression();

class Compressor {
 public:
  explicit Compressor(Compression compression);
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;
  /// Appends the packed bytes.
  void Pack(std::string_view plain, Buffer* packed);

 private:
  struct Impl;
  const Compression compression_;
  std::unique_ptr<Impl> impl_;
};

/// Appends exactly `size` bytes to *plain. Empty if that worked; otherwise why not.
std::string Unpack(std::string_view packed, std::string_view compression, size_t size,
                   Buffer* plain);

}  // namespace Stg::recording

#endif
