// SPDX-License-Identifier: GPL-2.0-or-later
//
// Micro-benchmarks of single operations: rays, moves, pictures, world files. STAGE_WORLDS is the
// folder of the worlds, by default that of the source tree. STAGE_SCENE is the world of the
// TraceScene benchmarks, by default cave.world.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "pictures/trace.hh"
#include "sensing/fan_order.hh"
#include "sensing/scene.hh"
#include "sensing/tracer.hh"
#include "stage.hh"
#include "tests/support/hit_lists.hh"
#include "world/engine.hh"
#include "worldfile/worldfile.hh"

namespace {

std::string Worlds() {
  const char* folder = std::getenv("STAGE_WORLDS");
  return folder ? folder : STAGE_SOURCE_WORLDS;
}

void InitOnce() {
  static const bool done = [] {
    int argc = 0;
    Stg::Init(&argc, nullptr);
    return true;
  }();
  (void)done;
}

bool AnyBody(Stg::Model*, const Stg::Model*, const void*) { return true; }

/// Rays of 8 m from random places of a shipped world, in fans of 360.
void TraceRays(benchmark::State& state, const char* name, double width, double depth) {
  InitOnce();
  Stg::World world;
  if (!world.Load(Worlds() + "/" + name)) {
    state.SkipWithError("the world can't be loaded");
    return;
  }
  Stg::internal::sensing::Scene& scene = world.host().scene;
  Stg::RandomStream random(7);
  const Stg::internal::sensing::Tracer tracer(scene.grid);
  const Stg::ray_mask_t no_mask{nullptr, 0, 0, 0, 0};
  const uint32_t first = scene.tables.Find(2 * M_PI, 360);
  Stg::internal::sensing::TraceCounters counters;
  for (auto _ : state) {
    Stg::internal::sensing::Fan fan;
    fan.predicate = AnyBody;
    fan.z_test = false;
    const Stg::Pose origin(random.Uniform(-width / 2, width / 2),
                           random.Uniform(-depth / 2, depth / 2), 0.1, random.Uniform(-3, 3));
    Stg::internal::sensing::PlaceFan(&fan, origin, 8.0, scene.cells_per_metre);
    const Stg::ray_grid_t view = scene.grid.View(Stg::internal::grid::kEverything);
    for (uint32_t i = 0; i < 360; i++)
      benchmark::DoNotOptimize(tracer.Trace(
          fan, view, {scene.tables.all()[first + i], scene.tables.unit_vectors()[first + i]},
          no_mask, &counters));
  }
  state.SetItemsProcessed(static_cast<int64_t>(counters.rays));
}
BENCHMARK_CAPTURE(TraceRays, cave, "cave.world", 64.0, 64.0);
BENCHMARK_CAPTURE(TraceRays, hospital, "hospital.world", 540.0, 220.0);

enum class Without { kNothing, kLayers, kSelfMasks, kWalks };

bool StopsRanger(Stg::Model* candidate, const Stg::Model* finder, const void*) {
  return !candidate->IsRelated(finder) && !(candidate->vis.ranger_return < 0);
}

/// The rays of one ranger, in the order in which it adds them to the batch of a step.
void AddFans(Stg::internal::sensing::Scene* scene, const Stg::ModelRanger& ranger, Without without,
             Stg::internal::sensing::RayBatch* batch) {
  Stg::internal::sensing::SelfMask mask;
  if (without != Without::kSelfMasks) {
    Stg::internal::grid::Rasterizations own;
    ranger.Root()->CollectRasterizations(&own, false);
    mask = batch->MakeSelfMask(scene->grid, own, ranger.Root(), false);
  }
  const Stg::Pose frame = ranger.GetGlobalPose() + ranger.GetGeom().pose;
  for (const Stg::ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    Stg::internal::sensing::Fan fan;
    fan.predicate = StopsRanger;
    fan.finder = &ranger;
    Stg::Pose origin = frame + sensor.pose;
    origin.z += sensor.size.z / 2.0;
    Stg::internal::sensing::PlaceFan(&fan, origin, sensor.range.max, scene->cells_per_metre);
    fan.layer = without == Without::kLayers ? Stg::internal::grid::kEverything
                                            : scene->grid.RangerLayer(fan.z, fan.z_test);
    fan.record.first_direction = scene->tables.Find(sensor.fov, sensor.sample_count);
    batch->Add(fan, sensor.sample_count, mask);
  }
}

/// All rays of a world's subscribed rangers, with the robots at their starts: as in a step, without
/// one of its economies, or with the hit lists that a device would return.
void TraceScene(benchmark::State& state, Without without) {
  InitOnce();
  const char* file = std::getenv("STAGE_SCENE");
  Stg::World world;
  if (!world.Load(file ? std::string(file) : Worlds() + "/cave.world")) {
    state.SkipWithError("the world can't be loaded");
    return;
  }
  Stg::internal::sensing::Scene& scene = world.host().scene;
  Stg::internal::sensing::RayBatch batch;
  for (const Stg::Model* model : world.engine().models) {
    const auto* ranger = dynamic_cast<const Stg::ModelRanger*>(model);
    if (ranger && ranger->HasSubscribers()) AddFans(&scene, *ranger, without, &batch);
  }
  batch.Close(scene.tables);
  const Stg::internal::sensing::Tracer tracer(scene.grid);
  std::vector<uint32_t> listed;
  if (without == Without::kWalks) listed = Stg::test::ListHits(scene.grid, batch, 1);
  const Stg::internal::sensing::HitLists known{listed.data(), listed.empty() ? 0u : 1u};
  Stg::internal::sensing::TraceCounters counters;
  Stg::internal::sensing::Tracer::Hits hits;
  Stg::internal::sensing::FanOrder order;
  const std::vector<Stg::internal::sensing::FanInterval>& intervals = order.Of(batch);
  for (auto _ : state)
    for (const Stg::internal::sensing::FanInterval& interval : intervals)
      tracer.TraceFans(batch, batch.fans().subspan(interval.first, interval.count), known, &hits,
                       &counters);
  state.SetItemsProcessed(static_cast<int64_t>(counters.rays));
  state.counters["looks_per_ray"] = static_cast<double>(counters.potential_hits) /
                                    static_cast<double>(std::max<uint64_t>(1, counters.rays));
}
BENCHMARK_CAPTURE(TraceScene, as_it_is, Without::kNothing)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(TraceScene, without_layers, Without::kLayers)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(TraceScene, without_masks, Without::kSelfMasks)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(TraceScene, hits_known, Without::kWalks)->Unit(benchmark::kMillisecond);

/// A robot of the given width, in cells of 0.02 m, that moves back and forth near its start.
void MoveBody(benchmark::State& state) {
  InitOnce();
  Stg::World world;
  Stg::Model body(&world, nullptr, "model");
  Stg::Geom geom;
  geom.size = Stg::Size(static_cast<double>(state.range(0)) * 0.02,
                        static_cast<double>(state.range(0)) * 0.02, 1);
  body.SetGeom(geom);
  double step = 0;
  for (auto _ : state) {
    step += 1;
    body.SetPose(Stg::Pose(0.013 * std::fmod(step, 100.0), 0, 0, 0.01 * std::fmod(step, 300.0)));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(MoveBody)->Arg(2)->Arg(20)->Arg(100);

void LoadPicture(benchmark::State& state) {
  const std::string file = Worlds() + "/bitmaps/hospital.png";
  for (auto _ : state) benchmark::DoNotOptimize(Stg::picture::OutlinesOf(file));
}
BENCHMARK(LoadPicture)->Unit(benchmark::kMillisecond);

/// A world file with the given number of instances of a definition with 17 children.
void ParseWorldfile(benchmark::State& state) {
  std::string text = "define bot position( ranger(";
  for (int i = 0; i < 16; i++) text += " sensor( samples 1 range [0 5] )";
  text += " ) )\n";
  for (int i = 0; i < state.range(0); i++) text += "bot( name \"r\" pose [1 2 0 90] )\n";
  for (auto _ : state) {
    std::istringstream stream(text);
    Stg::Worldfile file;
    file.Load(stream);
    benchmark::DoNotOptimize(file.GetEntityCount());
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(ParseWorldfile)->Arg(10000)->Unit(benchmark::kMillisecond);

}  // namespace
