// SPDX-License-Identifier: GPL-2.0-or-later
//
// Delivers the messages of a world's radios at the beginning of a step.
//
// Begin() sorts the radios that have messages by their place, so that each receiver looks only at
// those nearby. Then receivers get their messages, independently of each other: each changes only
// itself and draws from its own random numbers, in an order that depends on distances and ids only.

#ifndef STAGE_MODELS_TYPES_RADIO_TRAFFIC_HH
#define STAGE_MODELS_TYPES_RADIO_TRAFFIC_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"
#include "models/types/place_index.hh"
#include "sensing/fan.hh"

namespace Stg {

class Host;
class Model;
class ModelRadio;
namespace internal::sensing {
struct Scene;
}

class RadioTraffic {
 public:
  void Add(ModelRadio* radio);
  void Remove(const ModelRadio* radio);
  void Clear() { radios_.clear(); }
  /// All radios of the world, in the order of creation.
  const std::vector<ModelRadio*>& radios() const { return radios_; }

  /// Collects the messages that are due at `now`, and the radios that run if there are any. Returns
  /// the number of receivers.
  size_t Begin(usec_t now, Host* host);
  /// Delivers to one of the receivers. Several threads may call it at once for different ones.
  void Deliver(size_t receiver) const;
  /// Removes the messages that were due from their senders.
  void End();

 private:
  /// A radio with messages that are due.
  struct Sender {
    ModelRadio* radio;
    Pose pose;  // global
  };
  /// Senders with ranges below `reach`, and not below half of it unless tiny. A search among them
  /// covers at most three strips of the index, which are `reach` wide.
  struct Group {
    double reach;
    std::vector<uint32_t> senders;
    std::vector<point_t> points;
    PlaceIndex places;  // of the senders
  };
  /// A sender in range of a receiver.
  struct Near {
    double distance;
    uint32_t sender;
  };

  void CollectSenders();
  void IndexSenders();
  Group* GroupWith(double reach);
  void PrepareRays(Host* host);
  void FindNear(const ModelRadio& receiver, const Pose& here, std::vector<Near>* near) const;
  void AddIfNear(uint32_t sender, double dx, double dy, const ModelRadio& receiver,
                 std::vector<Near>* near) const;
  bool Hears(const ModelRadio& receiver, const Pose& here, const Near& near) const;
  bool IsHidden(const ModelRadio& receiver, const Pose& here, const Near& near) const;
  void Receive(const Near& near, const Pose& here, ModelRadio* receiver) const;

  std::vector<ModelRadio*> radios_;
  // Data of a delivery, which keep their memory.
  std::vector<ModelRadio*> receivers_;
  std::vector<Sender> senders_;  // in the order of creation
  std::vector<Group> groups_;    // some may be empty
  usec_t now_ = 0;
  const sensing::Scene* scene_ = nullptr;
  sensing::Fan ray_;  // what the rays of all senders have in common
};

}  // namespace Stg

#endif
