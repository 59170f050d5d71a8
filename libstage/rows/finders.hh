// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sensors that find models with rays: bumpers, fiducial finders and blobfinders. Part of scene.hh.

#ifndef STAGE_ROWS_FINDERS_HH
#define STAGE_ROWS_FINDERS_HH

#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "sensing/fan.hh"

namespace Stg {
class Model;
class ModelBlobfinder;
class ModelBumper;
class ModelFiducial;
}  // namespace Stg

namespace Stg::rows {

/// Rays that ask which model they hit.
struct Finder {
  uint32_t mover, node;
  uint32_t rate;                 ///< in Scene::rates
  internal::sensing::Fan fan;    ///< all but its place
  uint32_t seen;                 ///< index in Scene::seen
  std::vector<uint32_t> others;  ///< bodies of other movers that the rays may hit
};

/// A line of a bumper: a single ray.
struct BumperLine {
  Finder finder;
  const ModelBumper* bumper;  ///< of the prototype
  uint32_t index;             ///< in the bumper
};

/// A model that a fiducial finder may see.
struct FiducialTarget {
  static constexpr uint32_t kStands = UINT32_MAX;
  Model* model;          ///< of the prototype
  uint32_t mover, node;  ///< kStands: the model is not part of a mover
  Pose place;            ///< after loading, global
};

struct FiducialFinder {
  Finder finder;
  ModelFiducial* model;                 ///< of the prototype
  std::vector<FiducialTarget> targets;  ///< in the order of creation
  uint32_t first_target;                ///< among those of a world
};

struct Blobfinder {
  Finder finder;
  const ModelBlobfinder* model;  ///< of the prototype
  double fov;                    ///< rad, finite
  uint32_t rays;
  uint32_t first_direction;  ///< in Scene::directions
  uint32_t first_blob;       ///< among those of a world

  /// The finder cannot see more blobs, because each has a ray, and between two is another.
  uint32_t max_blobs() const { return (rays + 1) / 2; }
};

/// All finders of a scene.
struct Finders {
  std::vector<BumperLine> bumper_lines;
  std::vector<FiducialFinder> fiducial_finders;
  std::vector<Blobfinder> blobfinders;
  uint32_t target_count = 0, blob_count = 0;  ///< of a world
  bool any = false;                           ///< whether there are some
  /// The model of each wall and of each row in the columns of contacts of outlines, for bumpers.
  std::vector<const Model*> wall_models, row_models;

  /// Calls f(Finder&) for each.
  template <typename F>
  void ForEach(F f) {
    for (BumperLine& line : bumper_lines) f(line.finder);
    for (FiducialFinder& finder : fiducial_finders) f(finder.finder);
    for (Blobfinder& finder : blobfinders) f(finder.finder);
  }
};

}  // namespace Stg::rows

#endif
