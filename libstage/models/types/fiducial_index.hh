// SPDX-License-Identifier: GPL-2.0-or-later
//
// Spatial index of what fiducial finders may see, so that each examines only nearby targets, and
// the list of finders.

#ifndef STAGE_MODELS_TYPES_FIDUCIAL_INDEX_HH
#define STAGE_MODELS_TYPES_FIDUCIAL_INDEX_HH

#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"
#include "messages/assert.hh"
#include "models/types/place_index.hh"

namespace Stg {

class Model;
class ModelFiducial;

class FiducialIndex {
 public:
  struct Target {
    Model* model;
    Pose pose;  ///< global
  };

  /// Reads the poses of all models that have a fiducial_return. Call it before finders look for
  /// targets. `models` is the list of all models of the world, in the order of creation. While the
  /// index is frozen, only the first call reads them.
  void Refresh(const std::vector<Model*>& models);
  /// Freeze the index only while no code runs that may move models or change their visibility.
  void SetFrozen(bool frozen) {
    frozen_ = frozen;
    is_current_ = false;
  }

  /// Returns the targets whose x and y lie within +-reach of the point, in the order of creation.
  /// Valid until this thread's next call. The cost depends on the number of nearby targets, not of
  /// all.
  const std::vector<uint32_t>& Near(double x, double y, double reach) const;
  const Target& target(uint32_t i) const {
    STAGE_ASSERT(is_current_ && i < targets_.size());
    return targets_[i];
  }

  /// Registers subscribed finders, which keep pointers to targets.
  void AddFinder(ModelFiducial* finder);
  void RemoveFinder(ModelFiducial* finder);

  /// Call before a model is deleted.
  void Forget(const Model* model);
  void Clear();
  /// Number of sightings examined in forgetting models; a measure of the work.
  uint64_t looked_at() const { return looked_at_; }

 private:
  struct Sighting {
    const Model* target;  // may be dangling; only compared
    uint32_t finder;      // model id
  };
  void ForgetSightings(const Model* target);
  bool CollectSightings();

  std::vector<Target> targets_;          // in the order of creation
  std::vector<point_t> points_;          // scratch memory of Refresh()
  PlaceIndex places_;                    // of the targets
  std::vector<ModelFiducial*> finders_;  // in the order of creation
  bool frozen_ = false;
  bool is_current_ = false;  // Refresh() has read the models since SetFrozen() and Forget()
  // Superset of the targets that finders point to, sorted by target.
  std::vector<Sighting> sightings_;
  bool sightings_known_ = false;
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
