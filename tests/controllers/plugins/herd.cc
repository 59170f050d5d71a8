// SPDX-License-Identifier: GPL-2.0-or-later
//
// A batch controller for tests: robots drive towards the middle of all robots, with random turns
// that grow with the number of steps. `herd speed=NUMBER` gives the speed in m/s.

#include "stage.hh"

namespace {

struct Parameters : Stg::ControllerParameters {
  double speed = 0.3;
};

class Herd : public Stg::BatchController {
 public:
  std::shared_ptr<const Stg::ControllerParameters> Prepare(
      Stg::ControllerSetup* setup) const override {
    auto parameters = std::make_shared<Parameters>();
    setup->ReadNumbers({{"speed", &parameters->speed, 0, 10}});
    while (Stg::ModelRanger* ranger = setup->FindUnusedRanger()) setup->Use(ranger);
    return parameters;
  }
  void Step(const Stg::ControllerBatch& batch) const override {
    for (size_t world = 0; world < batch.worlds; world++)
      for (size_t r = 0; r < batch.robots; r++) Drive(batch, world, r);
  }
  size_t memory_size() const override { return 2; }
  bool needs_poses() const override { return true; }

 private:
  static void Drive(const Stg::ControllerBatch& batch, size_t world, size_t r) {
    const size_t i = world * batch.robots + r;
    double* const memory = batch.memory + 2 * i;
    const auto& parameters = static_cast<const Parameters&>(*batch.robot[r]->parameters);
    const Stg::PlanarPose* const all = batch.all_poses + world * batch.all_robots;
    double x = 0, y = 0;
    for (size_t k = 0; k < batch.all_robots; k++) {
      x += all[k].x - all[batch.own[r]].x;
      y += all[k].y - all[batch.own[r]].y;
    }
    double nearest = 10;
    for (size_t s = 0; s < batch.robot[r]->sensors.size(); s++) {
      const double* const ranges = batch.RangesOf(world, r, s);
      for (size_t ray = 0; ranges && ray < batch.robot[r]->sensors[s].bearings.size(); ray++)
        nearest = std::min(nearest, ranges[ray]);
    }
    memory[0]++;
    memory[1] += nearest * batch.time[world] + batch.estimate[i].a + batch.velocity[i].x;
    const double bearing = Stg::ArcTangent(y, x) - batch.sensed[i].a;
    batch.command[i] = {nearest > 0.3 ? parameters.speed : 0, 0,
                        Stg::normalize(bearing) + batch.random[i].Uniform(-1, 1) * memory[0] / 500};
    if (batch.stalled[i]) batch.command[i].x = -parameters.speed;
  }
};

}  // namespace

STAGE_EXPORT_BATCH_CONTROLLER(Herd)
