// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelBumper: straight touch sensors. Part of <stage.hh>.

#ifndef STAGE_MODELS_BUMPER_HH
#define STAGE_MODELS_BUMPER_HH

#include <vector>

#include "models/model.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class ModelBumper : public Model, private internal::sensing::RaySink {
 public:
  /// A line of the given length, centred at the pose and perpendicular to its heading.
  class BumperConfig {
   public:
    Pose pose;  ///< in the bumper's frame; z is ignored
    meters_t length;

    BumperConfig() : length(0) {}
  };

  class BumperSample {
   public:
    /// Model that touches the line, obstacle or not, at any height; or null. With contacts of
    /// outlines also an obstacle that touches the robot within a centimetre of the line.
    Model* hit;
    point_t hit_point;  ///< of the latest contact, global

    BumperSample() : hit(NULL) {}
  };

  ModelBumper(World* world, Model* parent, const std::string& type);
  ~ModelBumper();

  // Owned by the model. The sensors may be changed in place.
  uint32_t bumper_count;
  BumperConfig* bumpers;  ///< null if there are none
  BumperSample* samples;  ///< null before the first update and without subscribers

  using Model::Load;
  void Load() override;
  /// Prints one line with 1 or 0 for each sensor.
  void Print(char* prefix) const override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void Startup() override;
  void Shutdown() override;
  /// Adds the touch lines to the batch of the step. The samples follow when it is traced.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;

 private:
  friend class RowBridge;
  struct Line {
    point_t start;
    double cosine, sine;  // of its heading
  };
  void MakeSamples();
  void FindTouched();
  void AddLine(uint32_t index, const Pose& frame, internal::sensing::FanList* fans);
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  std::vector<BumperConfig> configs_;
  std::vector<BumperSample> results_;
  std::vector<uint32_t> hit_ids_;  // ids of the models in results_, which may be deleted
  std::vector<Line> lines_;        // of the current update
  struct Touched {
    Model* model;
    point_t point;
  };
  std::vector<Touched> touched_;  // what touches each line in contacts of outlines; empty: nothing
};

}  // namespace Stg

#endif
