// SPDX-License-Identifier: GPL-2.0-or-later
//
// The image of a scene for devices: records of movers, bodies, sensors and what stands, in one
// buffer, see kernels/row_records.h.

#ifndef STAGE_ROWS_DEVICE_IMAGE_HH
#define STAGE_ROWS_DEVICE_IMAGE_HH

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "kernels/row_records.h"
#include "rows/scene.hh"

namespace Stg::rows {

/// Says what keeps the worlds of a scene from being stepped on a device, in words that follow
/// "because"; empty if nothing does.
std::string WhyNotOnDevice(const std::shared_ptr<const Scene>& scene);

struct DeviceImage {
  std::vector<uint64_t> words;  ///< a row_scene_t and its parts
  size_t state_bytes;           ///< of the columns of all worlds, and a lock
  size_t scratch_bytes;         ///< memory of all worlds during a step

  const row_scene_t& scene() const { return *reinterpret_cast<const row_scene_t*>(words.data()); }
};

/// The image for this number of worlds. The scene can be stepped on a device. `contact_bytes`: see
/// kContactBytes.
DeviceImage MakeDeviceImage(const std::shared_ptr<const Scene>& scene, size_t worlds,
                            size_t contact_bytes);

}  // namespace Stg::rows

#endif
