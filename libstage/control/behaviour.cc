// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in controller stage/behaviour: what a robot does is in its memory. See
// docs/controllers.md.

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "control/company_setup.hh"
#include "control/stock_batch.hh"
#include "control/stock_list.hh"
#include "kernels/row_behaviour.h"

namespace Stg::control {

namespace {

struct BehaviourParameters : StockParameters {
  std::array<double, ROW_BEHAVIOUR_SIZE> memory{};  ///< at first
};

/// The numbers of the memory. Those of the goal are required if the robot goes there.
std::vector<ControllerNumber> MemoryNumbers(double* memory) {
  return {{"kind", &memory[ROW_BEHAVIOUR_KIND], 0, ROW_BEHAVIOURS - 1},
          {"x", &memory[ROW_BEHAVIOUR_X], -kFar, kFar},
          {"y", &memory[ROW_BEHAVIOUR_Y], -kFar, kFar},
          {"speed", &memory[ROW_BEHAVIOUR_SPEED], 0, 1000},
          {"vx", &memory[ROW_BEHAVIOUR_VX], -1000, 1000},
          {"vy", &memory[ROW_BEHAVIOUR_VY], -1000, 1000},
          {"rate", &memory[ROW_BEHAVIOUR_RATE], -1000, 1000}};
}

class Behaviour : public BatchController {
 public:
  std::shared_ptr<const ControllerParameters> Prepare(ControllerSetup* setup) const override {
    auto parameters = std::make_shared<BehaviourParameters>();
    parameters->record.kind = ROW_BEHAVIOUR;
    row_behaviour_t& rule = parameters->record.rule.behaviour;
    double* const memory = parameters->memory.data();
    memory[ROW_BEHAVIOUR_SPEED] = 0.7;
    rule.interval = IntervalOf(setup->robot());
    std::vector<ControllerNumber> numbers = MemoryNumbers(memory);
    for (const ControllerNumber& number : WalkerNumbers(&rule.walker, setup->robot()))
      numbers.push_back(number);
    rule.walker.tolerance = 0.1;
    for (const ControllerNumber& number : EvaderNumbers(&rule.evader, "horizon"))
      numbers.push_back(number);
    setup->ReadNumbers(numbers);
    RequireWhole("kind", memory[ROW_BEHAVIOUR_KIND]);
    RequireWhole("neighbours", rule.evader.most);
    if (row_behaviour_of(memory) >= ROW_GOES_STRAIGHT) RequireGoal(*setup, numbers, memory);
    UseRangers(setup, parameters.get());
    return parameters;
  }

  void Step(const ControllerBatch& batch) const override {
    static thread_local std::vector<double> buffer;
    DriveAll(batch, [](const InBatch& at, row_planar_t* command) {
      double* const memory = at.batch.memory + ROW_BEHAVIOUR_SIZE * at.index();
      const int kind = row_behaviour_of(memory);
      const bool looks = kind == ROW_WALKS || kind == ROW_EVADES;
      const double* const ranges = looks ? ReadingsOf(at, &buffer) : nullptr;
      if (looks && !ranges) return;
      const row_company_t all = at.all();
      row_behave(&at.parameters().record.rule.behaviour, at.parameters().layout->record(), ranges,
                 &all, at.batch.stalled[at.index()], memory, command);
    });
  }

  size_t memory_size() const override { return ROW_BEHAVIOUR_SIZE; }
  bool needs_velocities() const override { return true; }
  void FillMemory(const ControlledRobot& robot, double* memory) const override {
    std::ranges::copy(static_cast<const BehaviourParameters&>(*robot.parameters).memory, memory);
  }

 private:
  static void RequireGoal(const ControllerSetup& setup,
                          const std::vector<ControllerNumber>& numbers, double* memory) {
    memory[ROW_BEHAVIOUR_X] = memory[ROW_BEHAVIOUR_Y] = std::numeric_limits<double>::quiet_NaN();
    setup.ReadNumbers(numbers);
  }
};

}  // namespace

const BatchController* BehaviourController() {
  static const Behaviour controller;
  return &controller;
}

}  // namespace Stg::control
