// SPDX-License-Identifier: GPL-2.0-or-later
//
// What can be shown and hidden: one table of all switches, with the names that menus and the
// `window` section of world files have for them. No toolkit, no OpenGL.

#ifndef STAGE_GUI_VIEW_VIEW_OPTIONS_HH
#define STAGE_GUI_VIEW_VIEW_OPTIONS_HH

#include <cstddef>
#include <string>
#include <vector>

namespace Stg {
class Visualizer;
class World;
class Worldfile;
}  // namespace Stg

namespace Stg::view {

/// The switches that every window has, in the order of the table.
enum class Show : unsigned {
  kData,
  kBlocks,
  kFlags,
  kClock,
  kFollow,
  kFootprints,
  kGrid,
  kStatus,
  kPerspective,
  kOccupancy,
  kBoundingBoxes,
  kVoxels,  // no effect
  kRays,
  kTrailArrows,
  kTrailFast,
  kTrailBlocks,
  kTrailBlur,  // no effect
  kOverlay,
  kScreenshots,
  kSelectedOnly,
  // What follows are the switches of the data filter, for the types of models that there are.
  kRanger,
  kRangerArea,
  kRangerStrikes,
  kRangerFov,
  kRangerTransducers,
  kPositionCoordinates,
  kPositionWaypoints,
  kBlobfinder,
  kFiducials,
  kFiducialFov,
  kGripper,
  kBumpers,
  kCamera,
  kBlink,
  kWifi,
  kRasterization,
  kEnergyOutput,
  kEnergyStored,
  kEnergyDissipation,
};
inline constexpr std::size_t kShowCount = static_cast<std::size_t>(Show::kEnergyDissipation) + 1;

/// Where a switch is found.
enum class Place { kViewMenu, kDebugMenu, kTrailsMenu, kFilter, kNowhere };

struct Option {
  std::string menu_name;  ///< without the submenu's name
  std::string property;   ///< of the window section
  std::string shortcut;   ///< as in "d", "Ctrl+O"; empty: none
  Place place;
  bool on;
  bool offered;  ///< false: of the filter, but nothing in this world has it
};

class ViewOptions {
 public:
  ViewOptions();

  bool operator[](Show option) const { return options_[static_cast<std::size_t>(option)].on; }
  void Set(Show option, bool on) { options_[static_cast<std::size_t>(option)].on = on; }

  /// All of them; those of Show come first. Indices stay valid.
  const std::vector<Option>& all() const { return options_; }
  void Set(std::size_t index, bool on) { options_[index].on = on; }
  void Toggle(std::size_t index) { options_[index].on = !options_[index].on; }

  /// Back to the defaults, without what Register() added.
  void Reset();

  /// A visualizer's switch: makes one unless there is one of that menu name; the first decides
  /// whether it is on. Returns its index.
  std::size_t Register(const std::string& menu_name, const std::string& property, bool on);
  /// Whether the visualizer's switch is on; false if it was never registered.
  bool IsOn(const std::string& menu_name) const;
  /// Offers the filter's switches for the types of models that the world has.
  void OfferFor(const World& world);
  /// The indices of what the filter offers, by menu name.
  std::vector<std::size_t> Filter() const;

  /// From and to the properties of an entity (the window section). Absent ones change nothing.
  void Load(Worldfile* file, int entity);
  void Save(Worldfile* file, int entity) const;

 private:
  std::vector<Option> options_;
};

}  // namespace Stg::view

#endif
