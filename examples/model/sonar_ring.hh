// SPDX-License-Identifier: GPL-2.0-or-later
//
// The class of the plug-in's models. Controllers include this and link to nothing but Stage, since
// the plug-in is loaded with the world. Models with GetModelType() == "sonar_ring" are of this
// class; dynamic_cast would need the plug-in at link time.

#ifndef SONAR_RING_HH
#define SONAR_RING_HH

#include <cstdint>
#include <string>
#include <vector>

#include "stage.hh"

class SonarRing : public Stg::Model, private Stg::Model::RaySink {
 public:
  SonarRing(Stg::World* world, Stg::Model* parent, const std::string& type);
  ~SonarRing() override;

  /// Distance to the nearest thing in each cone, metres, or the maximum range. The first cone looks
  /// ahead, the others follow counter-clockwise.
  const std::vector<double>& ranges() const { return ranges_; }

  using Stg::Model::Load;
  void Load() override;
  void ExchangeState(Stg::StateExchange& exchange) override;

 protected:
  void Startup() override;
  void Shutdown() override;
  void Update() override;
  void Gather(FanList* fans) override;

 private:
  void ReceiveHits(std::uint32_t sonar, const RayHits& hits) override;

  double reach_ = 5;    // metres
  double width_ = 0.3;  // width of a cone, radians
  std::vector<double> ranges_;
  bool expects_hits_ = false;  // rays are in the batch
};

#endif
