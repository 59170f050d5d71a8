// SPDX-License-Identifier: GPL-2.0-or-later
//
// Time of a step of 1000 robots with 360 rays each, without a field and with one of 1000 x 1000
// cells in which every value spreads and evaporates in each step; and of that update alone.
//
// Reports an error unless the field has spread: its contrast must have shrunk, and its integral
// must be that of exponential decay.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "models/field.hh"
#include "stage.hh"

namespace {

using Stg::ModelField;
using Stg::World;

constexpr double kEvaporation = 0.01;
constexpr char kField[] =
    "field( name \"f\" size [50 50 0] field_resolution 0.05 diffusion 0.004 evaporation 0.01 )\n";

std::string Robots(int count) {
  std::string text = "resolution 0.05\n";
  for (const char* wall : {"pose [0 25 0 0] size [50 0.2 1]", "pose [0 -25 0 0] size [50 0.2 1]",
                           "pose [25 0 0 0] size [0.2 50 1]", "pose [-25 0 0 0] size [0.2 50 1]"})
    text += "model( " + std::string(wall) + " )\n";
  for (int i = 0; i < count; i++)
    text += "position( size [0.4 0.4 0.4] pose [" + std::to_string(i % 32 * 1.5 - 23.5) + " " +
            std::to_string(i / 32 * 1.5 - 23.5) + " 0 " + std::to_string(i * 37 % 360) +
            "] alwayson 1 ranger( pose [0 0 -0.2 0] alwayson 1 sensor( range [0 8] fov 360 samples "
            "360 ) ) )\n";
  return text;
}

struct Contrast {
  double highest, integral;
};

Contrast ContrastOf(const ModelField& field) {
  double highest = 0;
  for (const double value : field.values()) highest = std::max(highest, std::fabs(value - 1));
  return {highest, field.Integral()};
}

/// Gives each cell a value of its own around 1.
void Fill(ModelField* field) {
  Stg::RandomStream random(1);
  std::vector<double> values(field->values().size());
  for (double& value : values) value = random.Uniform(0.5, 1.5);
  field->SetValues(values.data(), values.size());
}

void Run(benchmark::State& state, int robots, bool has_field) {
  Stg::Init(nullptr, nullptr);
  Stg::RunOptions options;
  options.threads = static_cast<int>(state.range(0));
  World world(options);
  std::istringstream content(Robots(robots) + (has_field ? kField : ""));
  if (!world.Load(content, "fields.world")) return state.SkipWithError("can't load the world");
  double turn = -0.5;
  for (Stg::Model* model : world.GetAllModels())
    if (auto* const robot = dynamic_cast<Stg::ModelPosition*>(model))
      robot->SetSpeed(0.3, 0, turn += 0.001);
  auto* const field = has_field ? dynamic_cast<ModelField*>(world.GetModel("f")) : nullptr;
  if (field) Fill(field);
  const Contrast before = field ? ContrastOf(*field) : Contrast{};
  world.Update();  // makes tables and the second array of the field
  size_t steps = 1;
  for (auto _ : state) {
    world.Update();
    steps++;
  }
  if (!field) return;
  const Contrast after = ContrastOf(*field);
  const double kept = std::exp(-kEvaporation * 0.1 * static_cast<double>(steps));
  if (field->columns() != 1000 || field->rows() != 1000)
    return state.SkipWithError("the field has another number of cells");
  if (std::fabs(after.integral / (before.integral * kept) - 1) > 1e-9)
    return state.SkipWithError("the integral of the field is wrong");
  if (steps < 50 && after.highest > before.highest)
    return state.SkipWithError("the field has not spread");
}

void StepWithoutField(benchmark::State& state) { Run(state, 1000, false); }
void StepWithField(benchmark::State& state) { Run(state, 1000, true); }
void FieldAlone(benchmark::State& state) { Run(state, 0, true); }

BENCHMARK(StepWithoutField)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(StepWithField)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(FieldAlone)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
