// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelWifi: a radio that determines which others it reaches. Part of <stage.hh>.
//
// Computes the path loss in dB to each device outside its own tree. With f the sender's frequency
// in MHz and d the horizontal distance in metres, at least 1 cm:
//   friis         32.44177 + 20 log f + 20 log (d / 1000): free space
//   ITU indoor    20 log f + plc log d - 28
//   log distance  the friis loss at 1 m + 10 ple log d + a normal error of deviation sigma
//   raytrace      ITU indoor + 100 wall_factor for each metre inside of obstacles: bodies that
//                 rangers see, where the straight line between the devices meets them
// A device is reached if this one's power minus the loss is at least the other's sensitivity. With
// "simple" propagation, devices within range are reached.

#ifndef STAGE_MODELS_WIFI_HH
#define STAGE_MODELS_WIFI_HH

#include <string>
#include <vector>

#include "models/model.hh"
#include "random/random.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class ModelWifi : public Model, private internal::sensing::RaySink {
 public:
  /// A device that is reached.
  class Neighbor {
   public:
    Pose pose;  ///< global, at the start of the step
    std::string essid, mac, ip;
    double freq;  ///< MHz
    double db;    ///< power of this device's signal there, dBm; 1 if "simple"

    Neighbor() : freq(0), db(0) {}
    void ExchangeState(StateExchange& exchange);
  };

  typedef enum {
    PROPAGATION_NONE,
    PROPAGATION_SIMPLE,
    PROPAGATION_FRIIS,
    PROPAGATION_ITU_INDOOR,
    PROPAGATION_LOG_DISTANCE,
    PROPAGATION_RAYTRACE
  } Propagation;

  ModelWifi(World* world, Model* parent, const std::string& type);
  ~ModelWifi();

  /// Devices reached at the last update, in the order of their creation.
  const std::vector<Neighbor>& GetNeighbors() const { return neighbors_; }

  // May be changed at any time.
  Propagation propagation;
  std::string ip, mac, essid;
  double power;        ///< of the transmitter, dBm
  double sensitivity;  ///< of the receiver, dBm
  double freq;         ///< MHz
  meters_t range;
  double plc;          ///< power loss coefficient
  double ple;          ///< path loss exponent
  double sigma;        ///< dB
  double wall_factor;  ///< hundreds of dB per metre
  double range_db;     ///< level whose contour is drawn, dBm

  using Model::Load;
  void Load() override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void Reseed(uint64_t seed) override;
  void Startup() override;
  void Shutdown() override;
  /// Collects devices in reach and adds rays towards them to the batch of the step.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;
  /// Completes the list of neighbours.
  void Sensed() override;

 private:
  struct Path {
    Neighbor neighbor;
    const Model* tree;  // of the other device; only compared
    double distance, loss, budget;
    mutable std::vector<const Model*> obstacles;  // that the ray passed through
  };

  static bool NoteObstacle(Model* candidate, const Model* finder, const void* path);
  void LoadName(const char* property, std::string* name);
  double Loss(double distance);
  void AddPath(const ModelWifi& other, const Pose& here);
  void AddRay(uint32_t index, const Pose& here, internal::sensing::FanList* fans);
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  std::vector<Neighbor> neighbors_;
  std::vector<Path> paths_;  // only path_count_ are used; the rest keep their memory
  size_t path_count_;
  Pose here_;  // pose at the current update
  RandomStream random_;
  bool seeded_;
};

}  // namespace Stg

#endif
