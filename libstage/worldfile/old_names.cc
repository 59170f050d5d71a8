// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/old_names.hh"

#include <algorithm>

#include "worldfile/worldfile_impl.hh"

namespace Stg::worldfile {
namespace {

constexpr std::string_view kAnyType = "*";

/// A property or section type of older Stages.
struct OldName {
  std::string_view type;  ///< type of the sections that had the property; "" is the world
  std::string_view name;  ///< without numbers in its indices
  std::string_view advice;
};

constexpr std::string_view kBlocks =
    "use sections block( points N point[0] [X Y] ... z [LOW HIGH] )";
constexpr std::string_view kRange = "use range [LEAST MOST] in a section sensor";
constexpr std::string_view kInSensor = "give it to a section sensor inside of the ranger";
constexpr std::string_view kTransducers =
    "use sections sensor( pose [X Y Z HEADING] ) in the ranger";
constexpr std::string_view kRangerReturn = "use ranger_return";
constexpr std::string_view kBlobReturn = "use blob_return";
constexpr std::string_view kSpeedup = "use speedup, a multiple of real time";
constexpr std::string_view kWindowInterval = "use interval in the section window";
constexpr std::string_view kCameraSize = "use resolution [WIDTH HEIGHT]";
constexpr std::string_view kCameraView = "use fov [HORIZONTAL VERTICAL]";
constexpr std::string_view kPanTilt = "use pantilt [PAN TILT]";

constexpr OldName kProperties[] = {
    // Worlds.
    {"", "interval_real", kSpeedup},
    {"", "gui_interval", kWindowInterval},
    {"", "gui_menu_interval", kWindowInterval},
    {"", "gui_disable", "run with --gui (or -g) to have no window"},
    {"", "threadpool", "use threads"},
    {"", "worker_threads", "use threads"},
    {"", "size", "the world is as large as what is in it"},
    {"", "window_size", "use size in a section window"},
    {"", "ppm", "use resolution, the side of a cell in metres"},
    // Sensors that rangers replace.
    {"ranger", "range_max", kRange},
    {"sensor", "range_max", "use range [LEAST MOST]"},
    {"ranger", "range_min", kRange},
    {"sensor", "range_min", "use range [LEAST MOST]"},
    {"ranger", "samples", kInSensor},
    {"ranger", "range", kInSensor},
    {"ranger", "fov", kInSensor},
    {"ranger", "noise", kInSensor},
    {"ranger", "laser_sample_skip", "use fewer samples in a section sensor"},
    {"ranger", "resolution", "use fewer samples in a section sensor"},
    {kAnyType, "scount", kTransducers},
    {kAnyType, "spose[]", kTransducers},
    {kAnyType, "ssize", "use size in sections sensor"},
    {kAnyType, "ssize[]", "use size in sections sensor"},
    {kAnyType, "sview", "use range [LEAST MOST] and fov in sections sensor"},
    {kAnyType, "sview[]", "use range [LEAST MOST] and fov in sections sensor"},
    {"sensor", "view", "use range [LEAST MOST] and fov"},
    // Visibility to sensors.
    {kAnyType, "laser_return", kRangerReturn},
    {kAnyType, "sonar_return", kRangerReturn},
    {kAnyType, "blobfinder_return", kBlobReturn},
    {kAnyType, "vision_return", kBlobReturn},
    {kAnyType, "puck_return", "use gripper_return"},
    {kAnyType, "fiducial_id", "use fiducial_return"},
    // Bodies.
    {kAnyType, "polygons", kBlocks},
    {kAnyType, "polygon[]", kBlocks},
    {kAnyType, "polygon[].points", kBlocks},
    {kAnyType, "polygon[].point[]", kBlocks},
    {kAnyType, "polygon[].filled", kBlocks},
    {kAnyType, "polygon[].color", "use color in the model"},
    {kAnyType, "blocks", kBlocks},
    {kAnyType, "block[].points", kBlocks},
    {kAnyType, "block[].point[]", kBlocks},
    {kAnyType, "block[].z", kBlocks},
    {kAnyType, "block[].height", kBlocks},
    {kAnyType, "block[].color", "use color in the model"},
    {kAnyType, "lines", kBlocks},
    {kAnyType, "line[]", kBlocks},
    {kAnyType, "rects", kBlocks},
    {kAnyType, "rect[]", kBlocks},
    {kAnyType, "shape", "use sections block, or none for a box"},
    {kAnyType, "size3", "use size [X Y Z]"},
    {kAnyType, "offset", "use origin [X Y Z HEADING]"},
    {kAnyType, "center_of_rotation", "use origin [X Y Z HEADING]"},
    {kAnyType, "height", "use the third number of size"},
    // Appearance in a window.
    {kAnyType, "gui_boundary", "use gui_outline"},
    {kAnyType, "gui_movemask", "use gui_move 0 or 1"},
    {kAnyType, "gui_polygons", "bodies are always drawn filled"},
    {kAnyType, "fill_polygons", "bodies are always drawn filled"},
    {"window", "rangerdata", "use show_data or ranger_vis"},
    {"window", "show_waypoints", "use show_position_waypoints"},
    {"window", "redraw_interval", "use interval"},
    {"window", "update_interval", "use interval"},
    // Blobfinders, cameras, pan-tilt units.
    {"blobfinder", "channels", "use colors"},
    {"blobfinder", "channel_count", "use colors_count"},
    {"blobfinder", "channels_count", "use colors_count"},
    {"blobfinder", "range_max", "use range"},
    {"camera", "width", kCameraSize},
    {"camera", "height", kCameraSize},
    {"camera", "horizfov", kCameraView},
    {"camera", "vertfov", kCameraView},
    {"camera", "yaw", kPanTilt},
    {"camera", "pitch", kPanTilt},
    {"camera", "ptz", kPanTilt},
    // Robots, radios, energy.
    {"position", "odom_origin", "use localization_origin"},
    {"position", "velocity_max", "use velocity_bounds"},
    {"wifi", "range3", "use range"},
    {kAnyType, "watts_give", "use give_watts"},
    {kAnyType, "watts_take", "use take_watts"},
};

constexpr OldName kTypes[] = {
    {"", "laser", "use a ranger with a section sensor"},
    {"", "sonar", "use a ranger with a section sensor for each transducer"},
    {"", "ir", "use a ranger with a section sensor for each transducer"},
    {"", "ptz", "use a camera with pantilt, or a blobfinder with pan"},
    {"", "fiducialfinder", "use fiducial"},
    {"", "visiondevice", "use blobfinder"},
    {"", "vision", "use blobfinder"},
    {"", "blob", "use blobfinder"},
    {"", "lbd", "use fiducial"},
    {"", "box", "use model"},
    {"", "map", "use model with a bitmap"},
    {"", "bitmap", "use model with a bitmap"},
    {"", "environment", "use model with a bitmap"},
    {"", "puck", "use model with gripper_return 1"},
    {"", "gps", "use position with localization \"gps\""},
    {"", "truth", "no section is needed: poses are always known"},
    {"", "energy", "use joules or kjoules in the model"},
    {"", "charger", "use model with give_watts"},
    {"", "speech", "use say in the model"},
    {"", "gui", "use window"},
};

/// Maps files of older Stages to shipped files with similar models.
struct OldFile {
  std::string_view name, advice;
};
constexpr OldFile kFiles[] = {
    {"roomba.inc", "\"irobot.inc\" has this robot: roomba"},
    {"create.inc", "\"irobot.inc\" has this robot: create"},
    {"rplidar.inc", "\"sensors.inc\" has such a laser: round_scanner"},
};

bool Has(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

}  // namespace

std::string SuccessorOf(std::string_view property, std::string_view type) {
  const std::string name = WithoutIndices(property);
  std::string_view advice;
  for (const OldName& old : kProperties) {
    if (old.name != name) continue;
    if (old.type == type) return std::string(old.advice);
    if (old.type == kAnyType) advice = old.advice;
  }
  return std::string(advice);
}

std::string AdviceOnType(std::string_view type) {
  if (type == "world") return "properties of the world stand outside of all sections";
  if (type == "driver")
    return "this looks like a Player configuration; its \"worldfile\" names the world file";
  const auto* const found = std::ranges::find(kTypes, type, &OldName::name);
  return found == std::end(kTypes) ? "" : "older Stages had it: " + std::string(found->advice);
}

std::string SuccessorOfInclude(std::string_view file) {
  const std::string_view name = file.substr(file.find_last_of('/') + 1);
  const auto* const found = std::ranges::find(kFiles, name, &OldFile::name);
  return found == std::end(kFiles) ? "" : std::string(found->advice);
}

std::string KindOfForeignFile(std::string_view text) {
  constexpr std::size_t kLook = 4096;  // bytes; the beginning identifies a file's format
  const std::string_view start = text.substr(0, kLook);
  const std::size_t first = start.find_first_not_of(" \t\r\n");
  const char begin = first == std::string_view::npos ? '\0' : start[first];
  if (begin == '<') {
    if (Has(start, "<sdf") || Has(start, "<gazebo")) return "a Gazebo world (XML)";
    if (Has(start, "<robot")) return "a robot description (URDF)";
    if (Has(start, "<launch")) return "a ROS launch file (XML)";
    if (Has(start, "<mujoco")) return "a MuJoCo model (XML)";
    return "XML or HTML";
  }
  if (start.starts_with("#VRML") || start.starts_with("VRML")) return "a Webots world (VRML)";
  if (begin == '{') return "JSON";
  if (start.starts_with("\x89PNG") || start.starts_with("\xff\xd8\xff") ||
      start.starts_with("GIF8"))
    return "a picture";
  if (start.starts_with("\x89MCAP")) return "an MCAP log; stage replay shows it";
  if (Has(start, "driver") && Has(start, "provides")) return "a Player configuration";
  if (Has(start, "image:") && Has(start, "resolution:"))
    return "a map of ROS's map_server (YAML); give its picture to a model's bitmap";
  return "";
}

}  // namespace Stg::worldfile
