// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a viewer in another process has to know of a world: the things in it with their shapes,
// which seldom change, where they are, and what their rangers read.

#ifndef STAGE_PYTHON_SCENE_HH
#define STAGE_PYTHON_SCENE_HH

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace Stg {
class Model;
class World;
}  // namespace Stg

namespace Stg::python {

/// What moves as a whole: a robot, or a model on the ground, with all that it carries except for
/// robots.
struct Thing {
  uint32_t id = 0;
  std::string name, type;
  bool robot = false;
  bool movable = false;  ///< by the mouse
  float ground = 0;      ///< metres: what it stands on, when it is described
  float top = 0;         ///< metres above the ground, then
  /// Words of 32 bits, in the frame of the thing. For each area, the lowest first: red, green, blue
  /// and opacity as bytes; the lowest and the highest z, floats; how many outlines it has. For each
  /// of these: how many corners; x and y of each, floats. An outline within another one is a hole.
  /// The last area of a robot is its nose, if it has one: see models/robot_marks.hh.
  std::string shape;
};

/// All of them: the scenery first, of which the lowest comes first.
std::vector<Thing> ThingsOf(World& world);

/// Another number once ThingsOf() would tell something else.
uint64_t SceneKey(World& world);

/// x, y and heading of each model, in the frame of the world, and whether it is blocked. Those that
/// are gone get NaN.
void PlacesOf(World& world, const uint32_t* ids, size_t count, float* places, bool* stalled);

/// What the rangers on things read, those that have measured anything: words of 32 bits, for each
/// sensor. The number of its thing; how many samples; floats: x, y and heading of its origin in the
/// frame of the world, field of view, maximum range, and of each sample the range, then of each the
/// bearing. Ends before a sensor with which there would be more than `most` samples.
std::string ScansOf(World& world, const uint32_t* ids, size_t count, size_t most);

}  // namespace Stg::python

#endif
