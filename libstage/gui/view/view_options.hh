// SPDX-License-Identifier: GPL-2.0-or-later
//
// One table of everything that can be shown or hidden, with the names used in menus and in the
// `window` section of world files. No toolkit, no OpenGL.

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

/// Switches of every window, in the order of the table.
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
  // Switches of the data filter. They are offered only for model types that the world contains.
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
  kRadio,
  kFields,
  kLights,
  kRasterization,
  kEnergyOutput,
  kEnergyStored,
  kEnergyDissipation,
};
inline constexpr std::size_t kShowCount = static_cast<std::size_t>(Show::kEnergyDissipation) + 1;

/// Menu or dialog that contains a switch.
enum class Place { kViewMenu, kDebugMenu, kTrailsMenu, kFilter, kNowhere };

struct Option {
  std::string menu_name;  ///< without the submenu's name
  std::string property;   ///< name in the window section
  std::string shortcut;   ///< such as "d" or "Ctrl+O"; empty: none
  Place place;
  bool on;
  bool offered;  ///< false for filter switches that no model of this world has
};

class ViewOptions {
 public:
  ViewOptions();

  bool operator[](Show option) const { return options_[static_cast<std::size_t>(option)].on; }
  void Set(Show option, bool on) { options_[static_cast<std::size_t>(option)].on = on; }

  /// All options; those of Show come first. Indices stay valid.
  const std::vector<Option>& all() const { return options_; }
  void Set(std::size_t index, bool on) { options_[index].on = on; }
  void Toggle(std::size_t index) { options_[index].on = !options_[index].on; }

  /// Restores the defaults and removes the options added by Register().
  void Reset();

  /// Returns the index of a visualizer's switch, after adding it if no switch has this menu name.
  /// `on` is the initial state of a new switch.
  std::size_t Register(const std::string& menu_name, const std::string& property, bool on);
  /// True if the visualizer's switch is registered and on.
  bool IsOn(const std::string& menu_name) const;
  /// Offers the filter switches for all model types in the world.
  void OfferSwitchesFor(const World& world);
  /// Indices of the filter's offered switches, ordered by menu name.
  std::vector<std::size_t> Filter() const;

  /// Load from and save to an entity, the window section. Absent properties change nothing.
  void Load(Worldfile* file, int entity);
  void Save(Worldfile* file, int entity) const;

 private:
  std::vector<Option> options_;
};

}  // namespace Stg::view

#endif
