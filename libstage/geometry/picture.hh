// SPDX-License-Identifier: GPL-2.0-or-later
// Picture files (PNG, PBM, PGM, PPM) as rasters of one 8-bit sample a pixel.

#ifndef STAGE_GEOMETRY_PICTURE_HH
#define STAGE_GEOMETRY_PICTURE_HH

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace Stg {
namespace picture {

/// Rows from top to bottom, each from left to right, no padding: width * height samples.
/// A sample is the grey value of the pixel, or its red one if the picture has colours; palettes are
/// looked up first, 16-bit samples are cut to their high byte, transparency is ignored.
struct Raster {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> samples;
};

/// Reads the picture file at `path`.
/// Throws LoadError (exit status 255; one line, "PATH: reason") if it is missing, not a file, not a
/// picture of an accepted format, damaged, cut short, or larger than 32768 pixels a side or 1 GiB.
/// A file too short for the picture it declares is refused before memory is taken; note that a
/// PNG may honestly unpack to a thousand times its size, up to the limits above.
Raster Load(const std::string& path);

/// The same for a picture file that is in memory; `name` is what errors call it.
Raster LoadFromMemory(const void* data, std::size_t size, const std::string& name);

}  // namespace picture
}  // namespace Stg

#endif  // STAGE_GEOMETRY_PICTURE_HH
