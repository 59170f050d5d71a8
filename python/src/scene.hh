// SPDX-License-Identifier: GPL-2.0-or-later
//
// The data that a viewer in another process needs: things with their shapes, which seldom change,
// their poses, and the scans of their rangers.

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

/// A rigid group of models: a robot, or a model on the ground, with everything that it carries
/// except for robots.
struct Thing {
  uint32_t id = 0;
  std::string name, type;
  bool robot = false;
  bool movable = false;  ///< the mouse may move it
  float ground = 0;      ///< z of its base when described, metres
  float top = 0;         ///< z of its top when described, metres
  /// The areas from low to high, in the frame of the thing, as 32-bit words. Each area: red, green,
  /// blue and opacity (bytes); min and max z (floats); number of outlines. Each outline: number of
  /// corners, then x and y of each (floats). An outline within another one is a hole. If a robot
  /// has a nose (models/robot_marks.hh), it is the last area.
  std::string shape;
};

/// All things of the world: first the scenery from low to high, then the robots.
std::vector<Thing> ThingsOf(World& world);

/// The areas of a model's own body, without what it carries, in its own frame: see Thing::shape.
std::string BodyOf(const Model& model);

/// A hash of everything that ThingsOf() reports; it changes whenever the result would change.
uint64_t SceneKey(World& world);

/// Writes x, y (metres) and heading (radians) of each model in the world frame, and whether it is
/// stalled. A deleted model gets NaN and false.
void PlacesOf(World& world, const uint32_t* ids, size_t count, float* places, bool* stalled);

/// The readings of the rangers on things, as 32-bit words for each sensor that has readings. First
/// the id of its thing, the number of samples, and the simulated time at which it sensed, in
/// microseconds (two words, the low one first). Then floats, in metres and radians: x, y and
/// heading of the thing at that instant (NaN if unknown), the same of the sensor's origin, field of
/// view and maximum range; the range of each sample; the bearing of each sample. Poses are global.
/// Stops before a sensor that would raise the samples above `max_samples`.
std::string ScansOf(World& world, const uint32_t* ids, size_t count, size_t max_samples);

/// The glow of each light that is on (models/types/glow.hh), as 32-bit words: x, y and radius
/// (floats, metres), then red, green, blue and opacity (bytes).
std::string GlowsOf(World& world);

}  // namespace Stg::python

#endif
