// SPDX-License-Identifier: GPL-2.0-or-later
//
// Compression of chunks with the libraries that the program was built with.

#ifndef STAGE_RECORDING_COMPRESSION_HH
#define STAGE_RECORDING_COMPRESSION_HH

#include <memory>
#include <string>
#include <string_view>

#include "recording/buffer.hh"

namespace Stg::recording {

enum class Compression { kNone, kLz4, kZstd };

/// MCAP's name: "" for none, "lz4", "zstd".
const char* NameOf(Compression compression);
bool IsAvailable(Compression compression);
/// The default for logs: the fastest one available.
Compression DefaultCompression();

class Compressor {
 public:
  explicit Compressor(Compression compression);
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;
  /// Appends the compressed bytes to `packed`.
  void Compress(std::string_view plain, Buffer* packed);

 private:
  struct Impl;
  const Compression compression_;
  std::unique_ptr<Impl> impl_;
};

/// Appends exactly `size` decompressed bytes to `plain`. Returns "", or why that failed.
std::string Decompress(std::string_view packed, std::string_view compression, size_t size,
                       Buffer* plain);

}  // namespace Stg::recording

#endif
