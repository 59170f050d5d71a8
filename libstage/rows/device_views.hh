// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tables for devices of the standing bodies that rays of a height meet. On the host, a ray that has
// reached an occupied cell asks for its bodies; a device has a layer for each height without the
// cells that rays of this height pass, so its first cell is the hit.

#ifndef STAGE_ROWS_DEVICE_VIEWS_HH
#define STAGE_ROWS_DEVICE_VIEWS_HH

#include <cstdint>
#include <map>
#include <vector>

#include "kernels/row_records.h"
#include "rows/scene.hh"

namespace Stg::rows {

class DeviceViews {
 public:
  /// The tables of a height. See row_view_t.
  struct View {
    std::vector<uint64_t> tile_maps, tiles;
    std::vector<uint32_t> of_tiles, lists;
  };

  /// Makes the views of a scene's sensors, and sets row_sensor_t::view of their records.
  DeviceViews(const Scene& scene, std::vector<row_sensor_t>* sensors);

  const std::vector<View>& views() const { return views_; }
  const std::vector<row_wall_t>& walls() const { return walls_; }
  const std::vector<row_fragment_t>& fragments() const { return fragments_; }
  const std::vector<row_point_t>& corners() const { return corners_; }

 private:
  View CellView(const Sensor& sensor);
  View ExactView(const Sensor& sensor);
  uint32_t WallIn(const Sensor& sensor, internal::grid::CellRef cell);
  uint32_t WallOf(internal::grid::BodyId id);
  void AddTile(const Sensor& sensor, uint32_t slot, View* view);
  uint32_t FirstCornerOf(internal::grid::BodyId id);
  uint32_t BrightnessOf(const Model& model) const;

  const Scene& scene_;
  std::vector<View> views_;
  std::vector<row_wall_t> walls_;
  std::vector<row_fragment_t> fragments_;
  std::vector<row_point_t> corners_;
  std::map<internal::grid::BodyId, uint32_t> wall_of_, corner_of_;
};

}  // namespace Stg::rows

#endif
