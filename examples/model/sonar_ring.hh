// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers that read the sonars include this and link to nothing but Stage: the plug-in is there
// when the world is. A model with GetModelType() == "sonar_ring" is one of these; dynamic_cast
// would need the plug-in at link time.

#ifndef SONAR_RING_HH
#define SONAR_RING_HH

#include <string>
#include <vector>

#include "stage.hh"

class SonarRing : public Stg::Model {
 public:
  SonarRing(Stg::World* world, Stg::Model* parent, const std::string& type);

  /// Metres to the nearest thing in each cone, the one ahead first, then counter-clockwise; the
  /// reach where there is nothing.
  const std::vector<double>& ranges() const { return ranges_; }

  using Stg::Model::Load;
  void Load() override;
  void ExchangeState(Stg::StateExchange& exchange) override;

 protected:
  void Startup() override;
  void Shutdown() override;
  void Update() override;

 private:
  double reach_ = 5;    // metres
  double width_ = 0.3;  // of a cone, radians
  std::vector<double> ranges_;
  std::vector<Stg::RaytraceResult> cone_;  // scratch
};

#endif
