// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/compression.hh"

#include <stdexcept>

#include "messages/report.hh"
#ifdef STAGE_HAVE_LZ4
#include <lz4frame.h>
#endif
#ifdef STAGE_HAVE_ZSTD
#include <zstd.h>
#endif

namespace Stg::recording {

namespace {

#ifdef STAGE_HAVE_LZ4
void PackLz4(std::string_view plain, Buffer* packed) {
  LZ4F_preferences_t preferences = {};
  preferences.frameInfo.blockSizeID = LZ4F_max4MB;
  preferences.frameInfo.contentSize = plain.size();
  const size_t bound = LZ4F_compressFrameBound(plain.size(), &preferences), start = packed->size();
  uint8_t* space = packed->Extend(bound);
  const size_t size = LZ4F_compressFrame(space, bound, plain.data(), plain.size(), &preferences);
  if (LZ4F_isError(size)) throw std::runtime_error(LZ4F_getErrorName(size));
  packed->Shrink(start + size);
}

bool UnpackLz4(std::string_view packed, uint8_t* plain, size_t size) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) return false;
  size_t made = 0, left = 1;
  while (!packed.empty() && left != 0) {
    size_t space = size - made, taken = packed.size();
    left = LZ4F_decompress(context, plain + made, &space, packed.data(), &taken, nullptr);
    // No progress: the data are longer than announced.
    if (LZ4F_isError(left) || (space == 0 && taken == 0)) break;
    made += space;
    packed.remove_prefix(taken);
  }
  LZ4F_freeDecompressionContext(context);
  return left == 0 && made == size && packed.empty();
}
#endif

}  // namespace

const char* NameOf(Compression compression) {
  switch (compression) {
    case Compression::kNone:
      return "";
    case Compression::kLz4:
      return "lz4";
    case Compression::kZstd:
      return "zstd";
  }
  return "";
}

bool IsAvailable([[maybe_unused]] Compression compression) {
#ifndef STAGE_HAVE_LZ4
  if (compression == Compression::kLz4) return false;
#endif
#ifndef STAGE_HAVE_ZSTD
  if (compression == Compression::kZstd) return false;
#endif
  return true;
}

Compression DefaultCompression() {
  for (const Compression compression : {Compression::kLz4, Compression::kZstd})
    if (IsAvailable(compression)) return compression;
  return Compression::kNone;
}

struct Compressor::Impl {
#ifdef STAGE_HAVE_ZSTD
  ~Impl() { ZSTD_freeCCtx(zstd); }
  ZSTD_CCtx* zstd = ZSTD_createCCtx();
#endif
};

Compressor::Compressor(Compression compression)
    : compression_(compression), impl_(std::make_unique<Impl>()) {}

Compressor::~Compressor() = default;

void Compressor::Compress(std::string_view plain, Buffer* packed) {
#ifdef STAGE_HAVE_LZ4
  if (compression_ == Compression::kLz4) return PackLz4(plain, packed);
#endif
#ifdef STAGE_HAVE_ZSTD
  if (compression_ == Compression::kZstd) {
    constexpr int kFastest = 1;
    const size_t bound = ZSTD_compressBound(plain.size()), start = packed->size();
    uint8_t* space = packed->Extend(bound);
    const size_t size =
        ZSTD_compressCCtx(impl_->zstd, space, bound, plain.data(), plain.size(), kFastest);
    if (ZSTD_isError(size)) throw std::runtime_error(ZSTD_getErrorName(size));
    packed->Shrink(start + size);
    return;
  }
#endif
  packed->PutBytes(plain.data(), plain.size());
}

std::string Decompress(std::string_view packed, std::string_view compression, size_t size,
                       Buffer* plain) {
  plain->Reserve(size);
  uint8_t* space = plain->Extend(size);
  bool good = false;
  if (compression.empty()) {
    good = packed.size() == size;
    if (good && size > 0) std::memcpy(space, packed.data(), size);
#ifdef STAGE_HAVE_LZ4
  } else if (compression == "lz4") {
    good = UnpackLz4(packed, space, size);
#endif
#ifdef STAGE_HAVE_ZSTD
  } else if (compression == "zstd") {
    good = ZSTD_decompress(space, size, packed.data(), packed.size()) == size;
#endif
  } else {
    return "it is compressed by " + messages::Quoted(compression) +
           ", which this program was built without";
  }
  return good ? "" : "the compressed data are damaged";
}

}  // namespace Stg::recording
