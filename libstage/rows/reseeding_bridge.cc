// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random numbers of rows after World::Reseed(). A new seed of a world changes the seeds of all its
// models, but neither what loading has drawn nor, before the next update, the streams of sensors.

#include <algorithm>
#include <memory>
#include <vector>

#include "models/model_seed.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"
#include "world/initial_state.hh"

namespace Stg {

uint64_t RowBridge::LoadingSeedOf(const rows::Rows& rows, size_t row) {
  const rows::Reseeding* const reseeding = rows.columns.reseeding[row].get();
  return reseeding ? reseeding->loading_seed : rows.columns.seed[row];
}

/// Seeds of all models, in the order of creation.
std::vector<uint64_t> RowBridge::SeedsOfModels(const rows::Rows& rows, size_t row) {
  if (const auto& reseeding = rows.columns.reseeding[row]) return reseeding->models;
  const rows::Scene& scene = rows.scene();
  std::vector<uint64_t> seeds;
  for (const Model* model : scene.prototype->engine().models)
    seeds.push_back(SeedOf(scene, *model, rows.columns.seed[row]));
  return seeds;
}

/// The seed that the noise of a sensor gets if it is seeded now.
uint64_t RowBridge::SeedOfNoise(const rows::Rows& rows, size_t row, size_t number) {
  const rows::Scene& scene = rows.scene();
  const uint64_t seed = rows.columns.seed[row];
  const rows::Reseeding* const reseeding = rows.columns.reseeding[row].get();
  if (!reseeding) return SeedOfNoise(scene, number, seed);
  const rows::Sensor& sensor = scene.sensors[number];
  return Stg::SeedOfNoise(seed, sensor.name_hash, sensor.ranger->shares_name_,
                          reseeding->models[PlaceOf(scene, *sensor.ranger)]);
}

/// False if the sensor will be seeded in the next update.
bool RowBridge::IsSeeded(const rows::Rows& rows, size_t row, size_t sensor) {
  const rows::Reseeding* const reseeding = rows.columns.reseeding[row].get();
  const rows::Sensor& of = rows.scene().sensors[sensor];
  return !(reseeding && rows.IsNoisy(row, sensor) &&
           rows.LastUpdate(row, of.rate) == reseeding->update[of.rate]);
}

/// The stream of a sensor that has readings. Without noise it has not been used, and keeps the seed
/// of its first update.
RandomStream RowBridge::StreamOf(const rows::Rows& rows, size_t row, size_t sensor) {
  const rows::Scene& scene = rows.scene();
  const rows::Reseeding* const reseeding = rows.columns.reseeding[row].get();
  const bool is_noisy = rows.IsNoisy(row, sensor);
  if (reseeding && reseeding->had_readings[scene.sensors[sensor].rate] &&
      !(is_noisy && IsSeeded(rows, row, sensor)))
    return reseeding->sensors[sensor];
  if (is_noisy) return rows.columns.noise[row * scene.sensors.size() + sensor];
  return RandomStream(SeedOfNoise(rows, row, sensor));
}

void RowBridge::Reseed(rows::Rows* rows, size_t row, uint64_t seed) {
  const rows::Scene& scene = rows->scene();
  rows::Columns& c = rows->columns;
  auto reseeding = std::make_shared<rows::Reseeding>();
  reseeding->loading_seed = LoadingSeedOf(*rows, row);
  reseeding->models = SeedsOfModels(*rows, row);
  for (uint64_t& of_model : reseeding->models) of_model = MixSeeds(of_model, seed);
  for (uint32_t k = 0; k < scene.rates.size(); k++) {
    reseeding->had_readings.push_back(rows->HasReadings(row, k));
    reseeding->update.push_back(rows->LastUpdate(row, k));
  }
  for (size_t k = 0; k < scene.sensors.size(); k++)
    reseeding->sensors.push_back(StreamOf(*rows, row, k));
  c.seed[row] = seed;
  c.reseeding[row] = reseeding;
  for (size_t k = 0; !c.random.empty() && k < scene.movers.size(); k++)
    c.random[row * scene.movers.size() + k].Seed(
        reseeding->models[PlaceOf(scene, *scene.movers[k].model)]);
  for (size_t k = 0; !c.noise.empty() && k < scene.sensors.size(); k++)
    c.noise[row * scene.sensors.size() + k].Seed(SeedOfNoise(*rows, row, k));
}

/// Finds out whether the world has been reseeded, and assumes that it was loaded with the seed of
/// the prototype then.
void RowBridge::ReadReseeding(const World& world, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  auto& known = to->columns.reseeding[row];
  known.reset();
  auto reseeding = std::make_shared<rows::Reseeding>();
  for (const Model* model : world.engine().models)
    reseeding->models.push_back(model->random_.seed());
  if (reseeding->models == SeedsOfModels(*to, row)) return;
  reseeding->loading_seed = scene.prototype->seed();
  for (uint32_t k = 0; k < scene.rates.size(); k++)
    reseeding->had_readings.push_back(to->HasReadings(row, k));
  reseeding->update.assign(scene.rates.size(), UINT64_MAX);
  for (size_t k = 0; k < scene.sensors.size(); k++) {
    const rows::Sensor& of = scene.sensors[k];
    const auto& ranger = static_cast<const ModelRanger&>(*world.FindModel(of.ranger->GetId()));
    if (of.index >= ranger.sensors_.size()) return;  // ReadSensors() refuses such a world
    const ModelRanger::Sensor& sensor = ranger.sensors_[of.index];
    reseeding->sensors.push_back(sensor.random_);
    if (to->IsNoisy(row, k) && !sensor.seeded_)
      reseeding->update[of.rate] = to->LastUpdate(row, of.rate);
  }
  known = std::move(reseeding);
}

void RowBridge::WriteRandomNumbers(const rows::Rows& from, size_t row, World* world) {
  world->RestartRandomNumbers(*from.scene().initial_state, LoadingSeedOf(from, row));
  const rows::Reseeding* const reseeding = from.columns.reseeding[row].get();
  if (!reseeding) return;
  world->options_.seed = from.columns.seed[row];
  world->random_.Restart(world->options_.seed);
  const std::vector<Model*>& models = world->engine_->models;
  for (size_t i = 0; i < models.size(); i++) models[i]->random_.Restart(reseeding->models[i]);
}

}  // namespace Stg
