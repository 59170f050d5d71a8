// SPDX-License-Identifier: GPL-2.0-or-later
//
// Properties of the window section of world files. The window reads them. Without a window they are
// still looked up, so that only misspelt properties are reported as unknown.

#ifndef STAGE_WORLD_WINDOW_PROPERTIES_HH
#define STAGE_WORLD_WINDOW_PROPERTIES_HH

#include <string_view>

namespace Stg {

inline constexpr std::string_view kWindowProperties[] = {
    "size",
    "center",
    "rotate",
    "scale",
    "pcam_loc",
    "pcam_angle",
    "pcam_on",
    "interval",
    "screenshots",
    "screenshot_skip",
    "follow_model",
    "show_data",
    "show_blocks",
    "show_flags",
    "show_clock",
    "show_grid",
    "show_follow",
    "show_footprints",
    "show_occupancy",
    "show_boundingboxes",
    "show_trailblur",
    "show_trailarrows",
    "show_trailrise",
    "show_trailfast",
    "show_status",
    "show_voxels",
    "vis_all",
    "show_overlay",
    "show_rays",
    "show_wifi",
    "show_radio",
    "show_fields",
    "show_lights",
    "ranger_vis",
    "show_ranger_ranges",
    "show_ranger_strikes",
    "show_ranger_fov",
    "show_ranger_transducers",
    "blobfinder_vis",
    "show_fiducial",
    "show_fiducial_fov",
    "show_gripper_data",
    "show_bumper_hits",
    "show_camera",
    "show_blinken",
    "show_position_waypoints",
    "show_position_coords",
    "raster_vis",
    "energy_dissipation",
    "energy_input",
    "energy_stored",
    "vis_graph",
};

/// For code that reads a window property. A property missing from the list would be reported as
/// misspelt if there is no window.
constexpr bool IsWindowProperty(std::string_view name) {
  for (const std::string_view known : kWindowProperties)
    if (known == name) return true;
  return false;
}

}  // namespace Stg

#endif
