// SPDX-License-Identifier: GPL-2.0-or-later
// What the readers of the picture formats share. Part of picture.cc.

#ifndef STAGE_GEOMETRY_PICTURE_READER_HH
#define STAGE_GEOMETRY_PICTURE_READER_HH

#include <cstdint>
#include <cstdio>
#include <string>

#include "geometry/picture.hh"

namespace Stg {
namespace picture {

/// A picture file from its first byte on. `size` is its length in bytes.
struct Input {
  std::FILE* file;
  std::uint64_t size;
  const std::string& name;
  std::uint8_t threshold;
};

/// Throws LoadError: "NAME: reason".
[[noreturn]] void Fail(const Input& input, const std::string& reason);

/// An empty bitmap for the picture. Refuses what is too large before memory is taken for it.
/// `bits_per_pixel`: of all samples, decoded; `least_size`: a file of this picture cannot be
/// smaller.
Bitmap MakeBitmap(const Input& input, std::uint64_t width, std::uint64_t height,
                  std::uint64_t bits_per_pixel, std::uint64_t least_size);

Bitmap ReadPng(const Input& input);

/// PBM, PGM, PPM.
Bitmap ReadPnm(const Input& input);

Bitmap ReadBmp(const Input& input);

// Without their libraries, these two refuse the picture and say so.
Bitmap ReadJpeg(const Input& input);
Bitmap ReadGif(const Input& input);

}  // namespace picture
}  // namespace Stg

#endif  // STAGE_GEOMETRY_PICTURE_READER_HH
