// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/wander: drives about at random and avoids obstacles.

#include <memory>
#include <stdexcept>
#include <string>

#include "control/stock_batch.hh"
#include "control/stock_list.hh"
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
    auto parameters = std::make_shared<StockParameters>();
    parameters->record.kind = ROW_WANDER;
    row_wander_t& rule = parameters->record.rule.wander;
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
    DriveAll(batch, [](const InBatch& at, row_planar_t* command) {
      const double* const ranges = at.batch.RangesOf(at.world, at.robot, 0);
      if (!ranges) return;
      row_random_t random;
      RandomStream* const stream = &at.batch.random[at.index()];
      std::memcpy(&random, static_cast<const void*>(stream), sizeof random);
      row_wander(&at.parameters().record.rule.wander, ranges,
                 static_cast<ray_uint>(at.of().sensors[0].bearings.size()),
                 &at.batch.memory[at.index()], &random, command);
      std::memcpy(static_cast<void*>(stream), &random, sizeof random);
    });
  }

  size_t memory_size() const override { return 1; }
};

}  // namespace

const BatchController* WanderController() {
  static const Wander controller;
  return &controller;
}

}  // namespace Stg::control
