// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/phases/field_phase.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "models/field.hh"
#include "models/groundsensor.hh"
#include "models/types/field_evolution.hh"
#include "threads/wall_clock.hh"
#include "world/engine.hh"

namespace Stg {

namespace {
// Cells of a range that a thread takes: some ten microseconds of work.
constexpr size_t kCellsOfRange = 16384;
// A field with fewer cells is done before other threads have started.
constexpr size_t kManyCells = 4 * kCellsOfRange;
}  // namespace

void FieldPhase::Run(WorldEngine* engine, usec_t now, usec_t step) {
  AddDeposits(engine, static_cast<double>(step) / 1e6);
  for (ModelField* field : engine->fields) Evolve(field, now, engine);
}

void FieldPhase::AddDeposits(WorldEngine* engine, double seconds) {
  for (ModelGroundSensor* sensor : engine->ground_sensors) {
    if (sensor->pending_ == 0 && sensor->deposit_rate_ == 0) continue;
    const double amount = sensor->pending_ + sensor->deposit_rate_ * seconds;
    sensor->pending_ = 0;
    ModelField* const field = sensor->GetField();
    if (!field) continue;
    const Pose at = sensor->GetGlobalPose() + sensor->geom.pose;
    field->Deposit(at.x, at.y, amount);
  }
}

/// Makes the updates of the field that have become due since its last one, as one update.
void FieldPhase::Evolve(ModelField* field, usec_t now, WorldEngine* engine) {
  const usec_t due = now / field->interval * field->interval;
  if (due <= field->evolved_to_) return;
  const double seconds = static_cast<double>(due - field->evolved_to_) / 1e6;
  field->evolved_to_ = due;
  if ((field->diffusion_ == 0 && field->evaporation_ == 0) || !field->values_->AnyLive()) return;
  Evolve(*field, seconds, field->values_.get(), engine);
}

void FieldPhase::Evolve(const ModelField& field, double seconds, FieldValues* values,
                        WorldEngine* engine) {
  const int count = std::min(field::CountSubsteps(field, seconds), field::kMaxSubsteps);
  const FieldValues::Substep substep = field::SubstepOf(field, seconds, count);
  const size_t grain = std::max<size_t>(1, kCellsOfRange / values->columns());
  const bool shared = values->all().size() >= kManyCells && engine->threads() > 1;
  for (int i = 0; i < count; i++) {
    values->Begin(substep);
    threads::RunOn(shared ? engine->workers() : nullptr, values->rows(), grain,
                   [&](size_t begin, size_t end, unsigned) { values->EvolveRows(begin, end); });
    values->End();
  }
}

double FieldPhase::MeasureUpdate(const ModelField& field, WorldEngine* engine) {
  FieldValues values = *field.values_;
  for (size_t row = 0; row < values.rows(); row++) values.Set(row * values.columns(), 1);
  const double seconds = static_cast<double>(field.interval) / 1e6;
  Evolve(field, seconds, &values, engine);  // makes the second array
  const double start = threads::WallClock();
  Evolve(field, seconds, &values, engine);
  return threads::WallClock() - start;
}

}  // namespace Stg
