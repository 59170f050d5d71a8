// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/wander.hh"

#include <memory>
#include <stdexcept>
#include <string>

#include "control/records.hh"
#include "models/position.hh"
#include "models/ranger.hh"

namespace Stg::control {

namespace {

/// The first of the children ranger:0 to ranger:15 whose first sensor has more than 8 samples.
ModelRanger* FindLaser(const Model& robot) {
  constexpr int kNamesTried = 16;
  constexpr unsigned kFewSamples = 8;  // a laser has more
  for (int i = 0; i < kNamesTried; i++)
    for (Model* child : robot.GetChildren()) {
      if (child->TokenStr() != robot.TokenStr() + ".ranger:" + std::to_string(i)) continue;
      auto* const ranger = dynamic_cast<ModelRanger*>(child);
      if (ranger && !ranger->GetSensors().empty() &&
          ranger->GetSensors()[0].sample_count > kFewSamples)
        return ranger;
    }
  throw std::runtime_error(
      "found none of ranger:0 to ranger:15 with more than 8 samples, expected one");
}

class Wander : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    auto parameters = std::make_shared<WanderParameters>();
    row_wander_t& rule = parameters->rule;
    rule = {.speed = 0.4, .slow = 0.05, .turn = 0.5, .front = 1.0, .stop = 0.3};
    setup->ReadNumbers({{"speed", &rule.speed, 0, 1000},
                        {"slow", &rule.slow, 0, 1000},
                        {"turn", &rule.turn, 0, 1000},
                        {"front", &rule.front, 0, 1000},
                        {"stop", &rule.stop, 0, 1000}});
    setup->Use(FindLaser(setup->robot()));
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override {
    for (size_t world = 0; world < batch.worlds; world++)
      for (size_t r = 0; r < batch.robots; r++) {
        const double* const ranges = batch.RangesOf(world, r, 0);
        if (!ranges) continue;
        const size_t i = world * batch.robots + r;
        row_random_t random = RecordOf(batch.random[i]);
        row_planar_t command = RecordOf(batch.command[i]);
        row_wander(&static_cast<const WanderParameters&>(*batch.robot[r]->parameters).rule, ranges,
                   static_cast<ray_uint>(batch.robot[r]->sensors[0].bearings.size()),
                   &batch.memory[i], &random, &command);
        Store(random, &batch.random[i]);
        batch.command[i] = {command.x, command.y, command.a};
      }
  }

  size_t memory_size() const override { return 1; }
};

}  // namespace

const BatchController* WanderController() {
  static const Wander controller;
  return &controller;
}

}  // namespace Stg::control
