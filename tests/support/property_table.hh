// SPDX-License-Identifier: GPL-2.0-or-later
//
// A table of all properties of world files, each with a valid value.

#ifndef STAGE_TESTS_SUPPORT_PROPERTY_TABLE_HH
#define STAGE_TESTS_SUPPORT_PROPERTY_TABLE_HH

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

namespace properties {

struct Property {
  const char* entity;  ///< "world", "window", "sensor", "block" or a model type
  const char* name;
  const char* value;         ///< as in a file; SOURCE stands for the source folder
  const char* context = "";  ///< other properties that are required for this one to be read
};

inline constexpr Property kWorld[] = {
    {"world", "name", "\"w\""},
    {"world", "unit_length", "\"cm\""},
    {"world", "unit_angle", "\"radians\""},
    {"world", "interval_sim", "50"},
    {"world", "quit_time", "10"},
    {"world", "resolution", "0.05"},
    {"world", "memory_limit", "500"},
    {"world", "plugins", "\"sink\""},  // any plug-in will do
    {"world", "ray_model", "\"exact\""},
    {"world", "contacts", "\"outlines\""},
    {"world", "show_clock", "1"},
    {"world", "show_clock_interval", "10"},
    {"world", "threads", "2"},
    {"world", "test", "1"},
    {"world", "speedup", "2"},
    {"world", "paused", "1"},
    {"world", "confirm_on_quit", "0"},
};

/// Sections that are not models. The context has the properties that are mandatory.
inline constexpr Property kOrders[] = {
    {"population", "name", "\"crowd\"", "model \"position\" area [0 0 9 9]"},
    {"population", "model", "\"position\"", "area [0 0 9 9]"},
    {"population", "count", "3", "model \"position\" area [0 0 9 9]"},
    {"population", "area", "[0 0 9 9]", "model \"position\""},
    {"population", "gap", "0.5", "model \"position\" area [0 0 9 9]"},
    {"population", "seed", "4", "model \"position\" area [0 0 9 9]"},
    {"metric", "name", "\"driven\"", "kind \"distance\""},
    {"metric", "kind", "\"distance\""},
    {"metric", "model", "\"position\"", "kind \"distance\""},
    {"metric", "cell", "0.5", "kind \"coverage\""},
    {"metric", "goal", "[1 2]", "kind \"time_to_goal\""},
    {"metric", "radius", "1", "kind \"time_to_goal\" goal [1 2]"},
    {"metric", "first", "1", "kind \"time_to_goal\" goal [1 2]"},
};

inline constexpr Property kWindow[] = {
    {"window", "size", "[400 300]"},
    {"window", "center", "[1 2]"},
    {"window", "rotate", "[10 20]"},
    {"window", "scale", "20"},
    {"window", "pcam_loc", "[0 -4 3]"},
    {"window", "pcam_angle", "[70 0]"},
    {"window", "pcam_on", "1"},
    {"window", "interval", "50"},
    {"window", "screenshots", "1"},
    {"window", "screenshot_skip", "2"},
    {"window", "follow_model", "\"m\""},
    {"window", "show_data", "1"},
    {"window", "show_blocks", "1"},
    {"window", "show_flags", "1"},
    {"window", "show_clock", "1"},
    {"window", "show_grid", "1"},
    {"window", "show_follow", "1"},
    {"window", "show_footprints", "1"},
    {"window", "show_occupancy", "1"},
    {"window", "show_boundingboxes", "1"},
    {"window", "show_trailblur", "1"},
    {"window", "show_trailarrows", "1"},
    {"window", "show_trailrise", "1"},
    {"window", "show_trailfast", "1"},
    {"window", "show_status", "1"},
    {"window", "show_voxels", "1"},
    {"window", "vis_all", "1"},
    {"window", "show_overlay", "1"},
    {"window", "show_rays", "1"},
    {"window", "show_wifi", "1"},
    {"window", "show_fields", "0"},
    {"window", "show_lights", "0"},
    {"window", "show_radio", "1"},
    {"window", "ranger_vis", "1"},
    {"window", "show_ranger_ranges", "1"},
    {"window", "show_ranger_strikes", "1"},
    {"window", "show_ranger_fov", "1"},
    {"window", "show_ranger_transducers", "1"},
    {"window", "blobfinder_vis", "1"},
    {"window", "show_fiducial", "1"},
    {"window", "show_fiducial_fov", "1"},
    {"window", "show_gripper_data", "1"},
    {"window", "show_bumper_hits", "1"},
    {"window", "show_camera", "1"},
    {"window", "show_blinken", "1"},
    {"window", "show_position_waypoints", "1"},
    {"window", "show_position_coords", "1"},
    {"window", "raster_vis", "1"},
    {"window", "energy_dissipation", "1"},
    {"window", "energy_input", "1"},
    {"window", "energy_stored", "1"},
    {"window", "vis_graph", "1"},
};

/// Properties of every model.
inline constexpr Property kEveryModel[] = {
    {"model", "event_queue", "1"},
    {"model", "joules", "1000"},
    {"model", "joules_capacity", "1000"},
    {"model", "kjoules", "1"},
    {"model", "kjoules_capacity", "1"},
    {"model", "watts", "3"},
    {"model", "give_watts", "4"},
    {"model", "take_watts", "5"},
    {"model", "debug", "1"},
    {"model", "name", "\"n\""},
    {"model", "origin", "[0.1 0 0 10]"},
    {"model", "size", "[1 1 1]"},
    {"model", "pose", "[1 2 0 30]"},
    {"model", "color", "\"blue\""},
    {"model", "color_rgba", "[0 1 0 1]"},
    {"model", "noblocks", "1"},
    {"model", "bitmap", "\"SOURCE/worlds/bitmaps/rooms.png\""},
    {"model", "bitmap_frame", "\"picture\""},
    {"model", "boundary", "1"},
    {"model", "stack_children", "0"},
    {"model", "mass", "7"},
    {"model", "blob_return", "0"},
    {"model", "fiducial_key", "3"},
    {"model", "fiducial_return", "4"},
    {"model", "gripper_return", "1"},
    {"model", "obstacle_return", "0"},
    {"model", "ranger_return", "0.5"},
    {"model", "gui_nose", "1"},
    {"model", "gui_outline", "1"},
    {"model", "gui_grid", "1"},
    {"model", "gui_move", "1"},
    {"model", "map_resolution", "0.2"},
    {"model", "friction", "0.5"},
    {"model", "pushable", "1"},
    {"model", "floor_friction", "0.3"},
    {"model", "round", "1"},
    {"model", "ctrl", "\"sink\""},  // a controller that accepts any model
    {"model", "update_interval", "200"},
    {"model", "say", "\"hello\""},
    {"model", "trail_length", "5"},
    {"model", "trail_interval", "5"},
    {"model", "alwayson", "1"},
};

inline constexpr Property kTypes[] = {
    {"position", "velocity", "[0.1 0 0 5]"},
    {"position", "drive", "\"omni\""},
    {"position", "wheelbase", "0.5"},
    {"position", "steering_limit", "30"},
    {"position", "steering_rate", "45"},
    {"position", "car_command", "\"turn\""},
    {"position", "limit_acceleration", "1"},
    {"position", "stops_when_empty", "0"},
    {"position", "wheel_slip", "0.5"},
    {"position", "odom_noise", "[0.02 0.01 2 1]"},
    {"position", "odom", "[0 0 0 0]"},  // has no effect except for a message
    {"position", "localization_origin", "[1 1 0 0]"},
    {"position", "odom_error", "[0.01 0.01 0 1]"},
    {"position", "localization", "\"odom\""},
    {"position", "acceleration_bounds", "[-1 1 -1 1 -1 1 -45 45]"},
    {"position", "velocity_bounds", "[-1 1 -1 1 -1 1 -45 45]"},

    {"sensor", "pose", "[0.1 0 0 45]"},
    {"sensor", "size", "[0.01 0.01 0.01]"},
    {"sensor", "range", "[0 3]"},
    {"sensor", "fov", "90"},
    {"sensor", "samples", "10"},
    {"sensor", "noise", "[0.1 0.1 1]"},
    {"sensor", "range_step", "0.01"},
    {"sensor", "time_increment", "0.001"},
    {"sensor", "blind_near", "1"},
    {"sensor", "loss", "0.1"},
    {"sensor", "steepest", "80"},
    {"sensor", "color", "\"red\""},
    {"sensor", "color_rgba", "[1 0 0 0.5]"},
    {"sensor", "ray_model", "\"exact\""},
    {"sensor", "response", "[0 9 1 0]"},
    {"sensor", "response_noise", "[0.1 0.1]"},

    {"blobfinder", "image", "[40 30]"},
    {"blobfinder", "range", "6"},
    {"blobfinder", "fov", "90"},
    {"blobfinder", "pan", "10"},
    {"blobfinder", "colors", "[\"red\" \"blue\"]", "colors_count 2"},
    {"blobfinder", "colors_count", "1", "colors [\"red\"]"},

    {"fiducial", "range_min", "0.1"},
    {"fiducial", "range_max", "4"},
    {"fiducial", "range_max_id", "2"},
    {"fiducial", "fov", "90"},
    {"fiducial", "ignore_zloc", "1"},

    {"bumper", "bcount", "1"},
    {"bumper", "blength", "0.1", "bcount 1"},
    {"bumper", "bpose[0]", "[0.1 0 0 0]", "bcount 1"},
    {"bumper", "blength[0]", "0.2", "bcount 1"},

    {"camera", "resolution", "[16 16]"},
    {"camera", "range", "[0.1 4]"},
    {"camera", "fov", "[60 40]"},
    {"camera", "pantilt", "[10 5]"},

    {"gripper", "autosnatch", "1"},
    {"gripper", "paddle_size", "[0.5 0.1 0.4]"},
    {"gripper", "paddle_state", "[\"closed\" \"up\"]"},

    {"actuator", "type", "\"rotational\""},
    {"actuator", "axis", "[0 1 0]"},
    {"actuator", "max_speed", "0.5"},
    {"actuator", "max_position", "2"},
    {"actuator", "min_position", "-1"},
    {"actuator", "start_position", "0.5"},

    {"blinkenlight", "dutycycle", "0.5"},
    {"blinkenlight", "period", "500"},
    {"blinkenlight", "enabled", "0"},
    {"blinkenlight", "intensity", "2"},

    {"light", "intensity", "2"},
    {"light", "on", "0"},

    {"lightindicator", "intensity", "2"},

    {"lightsensor", "directions", "[0 90]"},
    {"lightsensor", "range", "4"},
    {"lightsensor", "fov", "90"},
    {"lightsensor", "cosine_power", "2"},
    {"lightsensor", "shadows", "0"},
    {"lightsensor", "least_distance", "0.1"},
    {"lightsensor", "ambient", "0.1"},
    {"lightsensor", "noise", "[0.1 0.1]"},
    {"lightsensor", "saturation", "5"},

    {"block", "points", "3", "point[0] [0 0] point[1] [1 0] point[2] [0 1]"},
    {"block", "point[0]", "[0 0]", "points 3 point[1] [1 0] point[2] [0 1]"},
    {"block", "point[2]", "[0 1]", "points 3 point[0] [0 0] point[1] [1 0]"},
    {"block", "z", "[0 1]"},

    {"wifi", "model", "\"friis\""},
    {"wifi", "ip", "\"10.0.0.1\""},
    {"wifi", "mac", "\"00:00:00:00:01\""},
    {"wifi", "essid", "\"lab\""},
    {"wifi", "power", "20"},
    {"wifi", "sensitivity", "-70"},
    {"wifi", "freq", "2400"},
    {"wifi", "range", "10"},
    {"wifi", "plc", "30"},
    {"wifi", "ple", "4"},
    {"wifi", "sigma", "2"},
    {"wifi", "wall_factor", "1"},
    {"wifi", "range_db", "-50"},

    {"field", "field_resolution", "0.1"},
    {"field", "initial", "-2"},
    {"field", "picture", "\"SOURCE/worlds/bitmaps/rooms.png\""},
    {"field", "picture_range", "[5 20]"},
    {"field", "diffusion", "0.001"},
    {"field", "evaporation", "0.01"},
    {"field", "edge", "\"open\""},
    {"field", "log_interval", "500"},

    {"groundsensor", "field", "\"g.f\"", "name \"g\" field( name \"f\" )"},
    {"groundsensor", "points", "3"},
    {"groundsensor", "point[0]", "[0.1 0]", "points 2"},
    {"groundsensor", "point[1]", "[0 0.1]", "points 2"},
    {"groundsensor", "interpolation", "\"nearest\""},
    {"groundsensor", "noise", "0.1"},
    {"groundsensor", "deposit_rate", "-0.5"},
    {"radio", "range", "5"},
    {"radio", "line_of_sight", "1"},
    {"radio", "delay", "2"},
    {"radio", "channel", "3"},
    {"radio", "loss", "0.1"},
    {"radio", "range_noise", "0.02"},
    {"radio", "bearing_noise", "5"},
    {"radio", "collisions", "1"},
    {"radio", "capacity", "10"},
};

inline std::string WithSource(std::string text) {
  const char* source = std::getenv("STAGE_SOURCE_DIR");
  const size_t at = text.find("SOURCE");
  return at == std::string::npos ? text : text.replace(at, 6, source ? source : "..");
}

/// A world in which the property has its value, but is called `name`.
inline std::string WorldWith(const Property& property, const std::string& name) {
  const std::string entity = property.entity;
  std::string body = name + " " + WithSource(property.value) + " " + property.context + "\n";
  if (entity == "world") return body;
  if (entity == "sensor") return "ranger( sensor( " + body + " ) )\n";
  if (entity == "block") return "model( block( " + body + " ) )\n";
  const std::string others = entity == "metric" ? "position( )\n" : "";  // a model to measure
  return entity + "( " + body + " )\n" + others;
}

/// The elements of a tuple, or the single value.
inline std::vector<std::string> ElementsOf(const std::string& value) {
  std::string inner = value;
  if (inner.front() == '[') inner = inner.substr(1, inner.size() - 2);
  std::istringstream stream(inner);
  std::vector<std::string> elements;
  for (std::string element; stream >> element;) elements.push_back(element);
  return elements;
}

inline void PrintTo(const Property& property, std::ostream* out) {
  *out << property.entity << ' ' << property.name;
}

inline std::string TestName(const testing::TestParamInfo<Property>& test) {
  std::string name = std::string(test.param.entity) + "_" + test.param.name;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); },
      '_');
  return name;
}

}  // namespace properties

#endif
