// SPDX-License-Identifier: GPL-2.0-or-later
//
// Spatial index of what fiducial finders may see, so that each examines only nearby targets, and
// the list of finders.

#ifndef STAGE_MODELS_FIDUCIAL_INDEX_HH
#define STAGE_MODELS_FIDUCIAL_INDEX_HH

#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class Model;
class ModelFiducial;

class FiducialIndex {
 public:
  struct Target {
    Model* model;
    Pose pose;  ///< global
  };

  /// Collects all models with a fiducial_return, once per step. Call it before finders look for
  /// targets. `models` are all models in the order of creation.
  void Refresh(const std::vector<Model*>& models, uint64_t step);

  /// Returns the targets whose x and y lie within +-reach of the point, in the order of creation.
  /// Valid until this thread's next call. The cost depends on the number of nearby targets, not of
  /// all.
  const std::vector<uint32_t>& Near(double x, double y, double reach) const;
  const Target& target(uint32_t i) const { return targets_[i]; }

  /// Registers subscribed finders, which keep pointers to targets.
  void AddFinder(ModelFiducial* finder);
  void RemoveFinder(ModelFiducial* finder);

  /// Call before a model is deleted.
  void Forget(const Model* model);
  void Clear();
  /// Number of sightings examined in forgetting models; a measure of the work.
  uint64_t looked_at() const { return looked_at_; }

 private:
  // The plane is divided into strips along y. Targets are sorted by strip, then by y.
  struct Place {
    double strip, y;
    uint32_t target;
    bool operator<(const Place& o) const;
  };

  struct Sighting {
    const Model* target;  // may be dangling; only compared
    uint32_t finder;      // model id
  };
  void ForgetSightings(const Model* target);
  bool CollectSightings();

  std::vector<Target> targets_;          // in the order of creation
  std::vector<Place> places_;            // sorted
  std::vector<ModelFiducial*> finders_;  // in the order of creation
  uint64_t step_ = 0;
  bool known_ = false;
  // Superset of the targets that finders point to, sorted by target.
  std::vector<Sighting> sightings_;
  bool sightings_known_ = false;
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
