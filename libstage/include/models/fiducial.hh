// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelFiducial: finds models that have a fiducial_return. Part of <stage.hh>.
//
// A model is found if its fiducial_key is the finder's, its origin is nearer than the range and
// within the field of view, it is not in the finder's own tree, and the ray towards its origin
// meets its body before any other body. Every unrelated body blocks the view, visible to other
// sensors or not; so do children of the target. Rays are horizontal, at the height of the finder.
//
// Edge cases, one rule each (they are tested in tests/models/fiducial_test.cc):
//   range 0, negative, NaN  nothing is found; a negative one is refused in a world file
//   distance = range        not found; distance = id range: the id reads 0
//   bearing = +-fov / 2     found
//   field of view >= 360    finds all around; negative or NaN: finds nothing
//   negative ids            are reported like others

#ifndef STAGE_MODELS_FIDUCIAL_HH
#define STAGE_MODELS_FIDUCIAL_HH

#include <vector>

#include "models/model.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class FiducialIndex;

class ModelFiducial : public Model, private internal::sensing::RaySink {
 public:
  class Fiducial {
   public:
    meters_t range;     ///< between the origins of finder and target; at least min_range
    radians_t bearing;  ///< relative to the finder
    Pose geom;          ///< x, y, z: the target's size; a: its heading relative to the finder
    Pose pose;          ///< global pose of the target
    Model* mod;         ///< the target. Its deletion removes the entry
    int id;             ///< its fiducial_return; 0 at max_range_id and beyond

    Fiducial() : range(0), bearing(0), mod(NULL), id(0) {}
    void ExchangeState(StateExchange& exchange);
  };

  ModelFiducial(World* world, Model* parent, const std::string& type);
  ~ModelFiducial();

  using Model::Load;
  void Load() override;
  /// Forgets what was found.
  void Shutdown() override;

  /// What the last update found, in the order of the targets' creation. Poses are those at the
  /// start of the step. Pointers into it are valid until the next update or deletion of a model.
  std::vector<Fiducial>& GetFiducials() { return fiducials_; }
  /// The same; `count` may be null. Without fiducials the pointer is of no use.
  Fiducial* GetFiducials(unsigned int* count);

  meters_t max_range_anon;  ///< beyond it nothing is found
  meters_t max_range_id;    ///< beyond it ids can't be read
  meters_t min_range;       ///< nearer targets are reported at this range
  radians_t fov;            ///< ahead, half of it on each side
  radians_t heading;        ///< no effect
  int key;                  ///< no effect: vis.fiducial_key is what has to match
  bool ignore_zloc;         ///< also find targets where the ray hits nothing at all

  void ExchangeState(StateExchange& exchange) override;
  /// Removes what refers to a model that is going to be deleted. For the library's own rooms.
  void ForgetTarget(const Model* target);
  /// Calls f(target) for all that it refers to.
  template <typename F>
  void ForEachTarget(F f) const {
    for (const std::vector<Fiducial>* list : {&fiducials_, &candidates_})
      for (const Fiducial& entry : *list) f(entry.mod);
  }

 protected:
  void Startup() override;
  /// Puts a ray for each candidate into the batch of the step; what was found follows when it is
  /// traced.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;

 private:
  void CollectCandidates();
  bool MakeCandidate(const Pose& own, Model* target, const Pose& there, Fiducial* candidate) const;
  void AddFan(internal::sensing::FanList* fans);
  void TakeHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  std::vector<Fiducial> fiducials_;
  std::vector<Fiducial> candidates_;  // their rays are on the way; mod is null if it was deleted
};

}  // namespace Stg

#endif
