// SPDX-License-Identifier: GPL-2.0-or-later
// Common interface of the readers for picture formats. Private to picture.cc and the readers.

#ifndef STAGE_PICTURES_PICTURE_READER_HH
#define STAGE_PICTURES_PICTURE_READER_HH

#include <cstdint>
#include <cstdio>
#include <string>

#include "pictures/picture.hh"

namespace Stg {
namespace picture {

/// An open picture file, positioned at its start. `size` is in bytes.
struct Input {
  std::FILE* file;
  std::uint64_t size;
  const std::string& name;
  std::uint8_t threshold;
  Samples* samples = nullptr;  // readers of PNG and PNM also store the samples here
};

/// Throws LoadError with the message "NAME: reason".
[[noreturn]] void Fail(const Input& input, const std::string& reason);

/// Makes an empty bitmap for the picture. Throws LoadError before allocation if it is too large.
/// `bits_per_pixel` counts all samples, decoded; `min_size` is the file's minimum size in bytes.
Bitmap MakeBitmap(const Input& input, std::uint64_t width, std::uint64_t height,
                  std::uint64_t bits_per_pixel, std::uint64_t min_size);

Bitmap ReadPng(const Input& input);

/// Reads PBM, PGM and PPM.
Bitmap ReadPnm(const Input& input);

Bitmap ReadBmp(const Input& input);

// Without their libraries, these two throw a LoadError that says so.
Bitmap ReadJpeg(const Input& input);
Bitmap ReadGif(const Input& input);

}  // namespace picture
}  // namespace Stg

#endif  // STAGE_PICTURES_PICTURE_READER_HH
