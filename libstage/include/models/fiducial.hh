// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelFiducial: finds models that have a fiducial_return. Part of <stage.hh>.
//
// A model is found if its fiducial_key equals the finder's, its origin is within range and field of
// view, it is not in the finder's tree, and the ray towards its origin hits its body first. All
// unrelated bodies block the view, even if invisible to other sensors; so do children of the
// target. Rays are horizontal, at the height of the finder.
//
// Edge cases, tested in tests/models/fiducial_test.cc:
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
    meters_t range;     ///< distance of the origins; at least min_range
    radians_t bearing;  ///< relative to the finder
    Pose geom;          ///< x, y, z: the target's size; a: its heading relative to the finder
    Pose pose;          ///< global pose of the target
    Model* mod;         ///< the target; the entry is removed with it
    int id;             ///< its fiducial_return; 0 at max_range_id and beyond

    Fiducial() : range(0), bearing(0), mod(NULL), id(0) {}
    void ExchangeState(StateExchange& exchange);
  };

  ModelFiducial(World* world, Model* parent, const std::string& type);
  ~ModelFiducial();

  using Model::Load;
  void Load() override;
  /// Deletes the fiducials.
  void Shutdown() override;

  /// Fiducials found by the last update, in the order of the targets' creation, with poses at the
  /// start of the step. Pointers into it are valid until the next update or deletion of a model.
  std::vector<Fiducial>& GetFiducials() { return fiducials_; }
  const std::vector<Fiducial>& GetFiducials() const { return fiducials_; }
  /// The fiducials as an array; `count` may be null. Do not use the pointer if there are none.
  Fiducial* GetFiducials(unsigned int* count);

  meters_t max_range_anon;  ///< maximum range
  meters_t max_range_id;    ///< maximum range at which ids are readable
  meters_t min_range;       ///< nearer targets are reported at this range
  radians_t fov;            ///< centred ahead
  radians_t heading;        ///< no effect
  int key;                  ///< no effect: vis.fiducial_key must match
  bool ignore_zloc;         ///< also find targets if the ray hits nothing

  void ExchangeState(StateExchange& exchange) override;
  /// Removes references to a model that is about to be deleted. Internal.
  void ForgetTarget(const Model* target);
  /// Calls f(target) for all targets to which the finder refers.
  template <typename F>
  void ForEachTarget(F f) const {
    for (const std::vector<Fiducial>* list : {&fiducials_, &candidates_})
      for (const Fiducial& entry : *list) f(entry.mod);
  }

 protected:
  void Startup() override;
  /// Adds a ray for each candidate to the batch of the step. The fiducials follow when it is
  /// traced.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;

 private:
  friend class RowBridge;
  void CollectCandidates();
  bool MakeCandidate(const Pose& own, Model* target, const Pose& there, Fiducial* candidate) const;
  void AddFan(internal::sensing::FanList* fans);
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  std::vector<Fiducial> fiducials_;
  std::vector<Fiducial> candidates_;  // their rays are in the batch; mod is null if deleted
};

}  // namespace Stg

#endif
