// SPDX-License-Identifier: GPL-2.0-or-later
//
// The numbers of a detection in arrays of readings: see Reading.

#ifndef STAGE_MODELS_TYPES_DETECTIONS_HH
#define STAGE_MODELS_TYPES_DETECTIONS_HH

#include <algorithm>
#include <cstdint>
#include <initializer_list>

#include "models/blobfinder.hh"
#include "models/fiducial.hh"

namespace Stg::detections {

inline void PutId(const ModelFiducial::Fiducial& seen, int32_t* to) { *to = seen.id; }
inline void PutRange(const ModelFiducial::Fiducial& seen, double* to) { *to = seen.range; }
inline void PutBearing(const ModelFiducial::Fiducial& seen, double* to) { *to = seen.bearing; }
inline void PutHeading(const ModelFiducial::Fiducial& seen, double* to) { *to = seen.geom.a; }

inline void PutColor(const ModelBlobfinder::Blob& blob, double* to) {
  const Color& color = blob.color;
  std::ranges::copy(std::initializer_list<double>{color.r, color.g, color.b, color.a}, to);
}
inline void PutBox(const ModelBlobfinder::Blob& blob, int32_t* to) {
  for (const uint32_t side : {blob.left, blob.top, blob.right, blob.bottom})
    *to++ = static_cast<int32_t>(side);
}
inline void PutBlobRange(const ModelBlobfinder::Blob& blob, double* to) { *to = blob.range; }

}  // namespace Stg::detections

#endif
