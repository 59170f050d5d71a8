// SPDX-License-Identifier: GPL-2.0-or-later
//
// What fiducial finders may see, so arranged that each of them looks only at what is near it; and
// which finders there are.

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

  /// Reads all models with a fiducial_return, unless it was done in this step before. To be called
  /// before finders look for targets. `models` are all there are, in the order of creation.
  void Refresh(const std::vector<Model*>& models, uint64_t step);

  /// The targets whose x and y both lie within +-reach of the point, in the order of creation.
  /// Valid until this thread's next call. The time it takes grows with the number of targets that
  /// are near, not of all.
  const std::vector<uint32_t>& Near(double x, double y, double reach) const;
  const Target& target(uint32_t i) const { return targets_[i]; }

  /// Subscribed finders: those that keep pointers to targets.
  void AddFinder(ModelFiducial* finder);
  void RemoveFinder(ModelFiducial* finder);

  /// A model that is going to be deleted.
  void Forget(const Model* model);
  void Clear();
  /// How many sightings were looked at to forget models: the work that these have made.
  uint64_t looked_at() const { return looked_at_; }

 private:
  // The plane is cut into strips along y, in each of which targets are sorted by y.
  struct Place {
    double strip, y;
    uint32_t target;
    bool operator<(const Place& o) const;
  };

  struct Sighting {
    const Model* target;  // may be gone; it is only compared
    uint32_t finder;      // its number
  };
  void ForgetSightings(const Model* target);
  bool CollectSightings();

  std::vector<Target> targets_;          // in the order of creation
  std::vector<Place> places_;            // sorted
  std::vector<ModelFiducial*> finders_;  // in the order of creation
  uint64_t step_ = 0;
  bool known_ = false;
  // All pointers to targets that finders have, and perhaps some more; sorted by target.
  std::vector<Sighting> sightings_;
  bool sightings_known_ = false;
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
