// SPDX-License-Identifier: GPL-2.0-or-later
// Polygons from picture files. Part of <stage.hh>.

#ifndef STAGE_PICTURES_IMAGE_POLYGONS_HH
#define STAGE_PICTURES_IMAGE_POLYGONS_HH

#include <string>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

/// Replaces `polys` by the outlines of the picture in `filename` (see pictures/trace.hh; threshold
/// 127) and returns 0. If the file cannot be read, reports why on standard error, leaves `polys`
/// alone and returns another number.
int polys_from_image_file(const std::string& filename, std::vector<std::vector<point_t>>& polys);

}  // namespace Stg

#endif
