// SPDX-License-Identifier: GPL-2.0-or-later
//
// The controllers of a scene as records for devices; part of device_image.hh.

#ifndef STAGE_ROWS_DEVICE_CONTROLS_HH
#define STAGE_ROWS_DEVICE_CONTROLS_HH

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "control/stock_controllers.hh"
#include "kernels/row_control.h"
#include "rows/scene.hh"

namespace Stg::rows {

/// Says which controller devices do not know, in words that follow "because"; empty if none.
std::string WhyNotControls(const Scene& scene);

/// The records of a scene whose controllers are all built in. The functions are named after the
/// parts of an image.
class DeviceControls {
 public:
  explicit DeviceControls(const Scene& scene);

  const std::vector<row_driven_t>& driven() const { return driven_; }
  const std::vector<row_control_t>& records() const { return records_; }
  const std::vector<uint32_t>& positions() const { return positions_; }
  bool needs_velocities() const { return needs_velocities_; }
  const std::vector<uint64_t>& layouts() const { return layouts_; }
  const std::vector<uint32_t>& look_of() const { return look_of_; }

 private:
  /// Layouts are equal if they are the same on the host, and if the sensors have the same rays,
  /// counted from the first one of the robot.
  using Key = std::pair<const control::RayLayout*, std::vector<uint32_t>>;

  void Add(const ControlGroup& group, size_t index);
  /// Offset of the layout in bytes.
  uint32_t FindLayout(const control::StockParameters& parameters, const Control& control,
                      uint32_t first_ray);
  uint32_t SectorsOf(const row_control_t& record) const;
  void GroupByRobot();

  std::vector<row_driven_t> driven_;
  std::vector<row_control_t> records_;
  std::vector<uint32_t> positions_;
  bool needs_velocities_ = false;
  std::vector<uint64_t> layouts_;
  std::vector<uint32_t> look_of_;
  std::map<Key, uint32_t> known_layouts_;
};

}  // namespace Stg::rows

#endif
