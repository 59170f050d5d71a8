// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/view/view_options.hh"

#include <algorithm>

#include "gui/view/type_switches.hh"
#include "world/window_properties.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg::view {

namespace {

struct Row {
  Show show;
  const char* menu_name;
  const char* property;
  const char* shortcut;
  Place place;
  bool on;
};

constexpr Row kTable[] = {
    {Show::kData, "Data", "show_data", "d", Place::kViewMenu, false},
    {Show::kBlocks, "Blocks", "show_blocks", "b", Place::kViewMenu, true},
    {Show::kFlags, "Flags", "show_flags", "l", Place::kViewMenu, true},
    {Show::kClock, "Clock", "show_clock", "c", Place::kViewMenu, true},
    {Show::kFollow, "Follow", "show_follow", "f", Place::kViewMenu, false},
    {Show::kFootprints, "Footprints", "show_footprints", "o", Place::kViewMenu, false},
    {Show::kGrid, "Grid", "show_grid", "g", Place::kViewMenu, true},
    {Show::kStatus, "Status", "show_status", "s", Place::kViewMenu, true},
    {Show::kPerspective, "Perspective camera", "pcam_on", "r", Place::kViewMenu, false},
    {Show::kOccupancy, "Occupancy", "show_occupancy", "Ctrl+O", Place::kDebugMenu, false},
    {Show::kBoundingBoxes, "Bounding boxes", "show_boundingboxes", "Ctrl+B", Place::kDebugMenu,
     false},
    {Show::kVoxels, "Voxels", "show_voxels", "", Place::kNowhere, false},
    {Show::kRays, "Rays of the selected robot", "show_rays", "Ctrl+Y", Place::kDebugMenu, false},
    {Show::kTrailArrows, "Rising Arrows", "show_trailarrows", "Ctrl+A", Place::kTrailsMenu, false},
    {Show::kTrailFast, "Fast", "show_trailfast", "Ctrl+F", Place::kTrailsMenu, false},
    {Show::kTrailBlocks, "Rising blocks", "show_trailrise", "Ctrl+R", Place::kTrailsMenu, false},
    {Show::kTrailBlur, "Blur", "show_trailblur", "", Place::kNowhere, false},
    {Show::kOverlay, "Performance figures", "show_overlay", "i", Place::kViewMenu, false},
    {Show::kScreenshots, "Save screenshots", "screenshots", "", Place::kViewMenu, false},
    {Show::kSelectedOnly, "Selected only", "vis_all", "", Place::kNowhere, false},
    {Show::kRanger, "Ranger", "ranger_vis", "", Place::kFilter, true},
    {Show::kRangerArea, "Ranger area", "show_ranger_ranges", "", Place::kFilter, true},
    {Show::kRangerStrikes, "Ranger strikes", "show_ranger_strikes", "", Place::kFilter, false},
    {Show::kRangerFov, "Ranger FOV", "show_ranger_fov", "", Place::kFilter, false},
    {Show::kRangerTransducers, "Ranger transducers", "show_ranger_transducers", "", Place::kFilter,
     false},
    {Show::kPositionCoordinates, "Position coordinates", "show_position_coords", "", Place::kFilter,
     false},
    {Show::kPositionWaypoints, "Position waypoints", "show_position_waypoints", "", Place::kFilter,
     true},
    {Show::kBlobfinder, "Blobfinder", "blobfinder_vis", "", Place::kFilter, true},
    {Show::kFiducials, "Fiducials", "show_fiducial", "", Place::kFilter, true},
    {Show::kFiducialFov, "Fiducial FOV", "show_fiducial_fov", "", Place::kFilter, false},
    {Show::kGripper, "Gripper data", "show_gripper_data", "", Place::kFilter, true},
    {Show::kBumpers, "Bumper hits", "show_bumper_hits", "", Place::kFilter, true},
    {Show::kCamera, "Show Camera Data", "show_camera", "", Place::kFilter, true},
    {Show::kBlink, "Show Blink", "show_blinken", "", Place::kFilter, true},
    {Show::kWifi, "Wifi", "show_wifi", "", Place::kFilter, true},
    {Show::kRadio, "Messages", "show_radio", "", Place::kFilter, true},
    {Show::kFields, "Fields", "show_fields", "", Place::kFilter, true},
    {Show::kLights, "Glow of lights", "show_lights", "", Place::kFilter, true},
    {Show::kRasterization, "Rasterization", "raster_vis", "", Place::kFilter, false},
    {Show::kEnergyOutput, "energy output", "energy_input", "", Place::kFilter, false},
    {Show::kEnergyStored, "energy stored", "energy_stored", "", Place::kFilter, false},
    {Show::kEnergyDissipation, "energy dissipation", "energy_dissipation", "", Place::kFilter,
     false},
};

constexpr bool InOrder() {
  std::size_t i = 0;
  for (const Row& row : kTable)
    if (static_cast<std::size_t>(row.show) != i++) return false;
  return i == kShowCount;
}
static_assert(InOrder(), "the table has a row for each Show, in its order");

constexpr bool AreAllKnown() {
  for (const Row& row : kTable)
    if (!IsWindowProperty(row.property)) return false;
  return true;
}
static_assert(AreAllKnown(), "world/window_properties.hh lacks a property of the table");

bool HasAny(const World& world, const TypeSwitches& type) {
  return std::ranges::any_of(world.GetAllModels(),
                             [&](const Model* model) { return type.is(*model); });
}

}  // namespace

ViewOptions::ViewOptions() { Reset(); }

void ViewOptions::Reset() {
  options_.clear();
  for (const Row& row : kTable)
    options_.push_back({row.menu_name, row.property, row.shortcut, row.place, row.on,
                        row.place != Place::kFilter});
  for (const TypeSwitches& type : AllTypeSwitches())
    for (const TypeSwitch& one : type.switches)
      if (!one.show)
        options_.push_back({one.menu_name, one.property, "", Place::kFilter, one.on, false});
}

std::size_t ViewOptions::Register(const std::string& menu_name, const std::string& property,
                                  bool on) {
  for (std::size_t i = 0; i < options_.size(); i++) {
    if (options_[i].place != Place::kFilter || options_[i].menu_name != menu_name) continue;
    options_[i].offered = true;
    return i;
  }
  options_.push_back({menu_name, property, "", Place::kFilter, on, true});
  return options_.size() - 1;
}

bool ViewOptions::IsOn(const std::string& menu_name) const {
  for (const Option& option : options_)
    if (option.place == Place::kFilter && option.menu_name == menu_name) return option.on;
  return false;
}

void ViewOptions::OfferSwitchesFor(const World& world) {
  options_[static_cast<std::size_t>(Show::kRasterization)].offered = true;  // offered for any model
  for (const TypeSwitches& type : AllTypeSwitches()) {
    if (!HasAny(world, type)) continue;
    for (const TypeSwitch& one : type.switches) {
      if (one.show)
        options_[static_cast<std::size_t>(*one.show)].offered = true;
      else
        Register(one.menu_name, one.property, one.on);
    }
  }
}

std::vector<std::size_t> ViewOptions::Filter() const {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < options_.size(); i++)
    if (options_[i].place == Place::kFilter && options_[i].offered) indices.push_back(i);
  std::sort(indices.begin(), indices.end(), [this](std::size_t a, std::size_t b) {
    return options_[a].menu_name < options_[b].menu_name;
  });
  return indices;
}

void ViewOptions::Load(Worldfile* file, int entity) {
  for (Option& option : options_)
    option.on = file->ReadInt(entity, option.property.c_str(), option.on) != 0;
}

void ViewOptions::Save(Worldfile* file, int entity) const {
  for (const Option& option : options_) file->WriteInt(entity, option.property.c_str(), option.on);
}

}  // namespace Stg::view
