// SPDX-License-Identifier: GPL-2.0-or-later
//
// The world of a belief: its file, its grid, and others who are far away until they are needed.

#include <map>
#include <memory>
#include <sstream>

#include "whatif/belief_impl.hh"
#include "worldfile/numbers.hh"

namespace Stg {

namespace {

/// A picture with one black pixel, because one without any is an error.
std::string FirstPicture(const Belief::Options& options) {
  std::string pixels(size_t{options.columns} * options.rows, '0');
  pixels[0] = '1';
  std::string picture =
      "P1\n" + std::to_string(options.columns) + " " + std::to_string(options.rows) + "\n";
  for (size_t i = 0; i < pixels.size(); i++) {
    picture += pixels[i];
    if (i % 64 == 63) picture += '\n';
  }
  return picture;
}

}  // namespace

std::unique_ptr<World> whatif::BeliefContent::Load(const std::string& content) const {
  RunOptions run;
  run.pictures = options.pictures;
  if (HasGrid()) {
    std::map<std::string, std::string> pictures;
    if (options.pictures) pictures = *options.pictures;
    pictures[std::string(kMapName) + ".pbm"] = FirstPicture(options);
    run.pictures = std::make_shared<const std::map<std::string, std::string>>(std::move(pictures));
  }
  run.listed = false;
  run.threads = 1;
  auto world = std::make_unique<World>(run);
  std::istringstream input(content);
  return world->Load(input, file) ? std::move(world) : nullptr;
}

std::unique_ptr<World> whatif::BeliefContent::MakeWorld(const std::vector<Group>& with) const {
  std::string all = text + "\n";
  size_t first = 0;
  for (const Group& group : with) {
    all += TextOf(group, first);
    first += group.room;
  }
  return Load(HasGrid() ? all + MapText() : all);
}

/// Models for all others of a group. The number of the first one is `first`.
std::string whatif::BeliefContent::TextOf(const Group& group, size_t first) const {
  constexpr double kFarAway = -10000;                 // m: beyond the reach of sensors
  constexpr double kFastest = 10, kFastestTurn = 10;  // m/s, rad/s
  const OtherKind& kind = options.kinds[group.kind];
  double widest = 0;
  for (const OtherKind& each : options.kinds) widest = std::max(widest, 2 * each.radius);
  const std::string side = Metres(2 * kind.radius);
  const std::string speed = "-" + Metres(kFastest) + " " + Metres(kFastest);
  const std::string turn = Radians(kFastestTurn);
  const std::string controller =
      group.controller.empty() ? "" : "ctrl \"" + group.controller + "\"";
  std::string all;
  for (size_t i = first; i < first + group.room; i++)
    all += "position( name \"" + NameOf(i) + "\" alwayson 1 pose [ " + Metres(kFarAway) + " " +
           Metres(static_cast<double>(i) * (widest + 1)) + " 0 0 ] size [ " + side + " " + side +
           " " + Metres(kind.height) +
           " ] round 1 drive \"omni\" localization \"gps\" mass 70\n  velocity_bounds [ " + speed +
           " " + speed + " 0 0 -" + turn + " " + turn + " ] " + controller + "\n  " + kind.body +
           "\n)\n";
  return all;
}

/// A model for the grid.
std::string whatif::BeliefContent::MapText() const {
  const double across = options.columns * options.resolution;
  const double along = options.rows * options.resolution;
  const Pose& origin = options.origin;
  const std::string name = kMapName;
  return "model( name \"" + name + "\" pose [ " + Metres(origin.x) + " " + Metres(origin.y) +
         " 0 " + Radians(origin.a) + " ] origin [ " + Metres(across / 2) + " " + Metres(along / 2) +
         " 0 0 ] size [ " + Metres(across) + " " + Metres(along) + " " +
         Metres(options.wall_height) + " ] bitmap \"" + name +
         ".pbm\" bitmap_frame \"picture\" )\n";
}

std::string whatif::BeliefContent::Metres(double value) const {
  return worldfile::TextInUnit(value, unit_length);
}

std::string whatif::BeliefContent::Radians(double value) const {
  return worldfile::TextInUnit(value, unit_angle);
}

}  // namespace Stg
