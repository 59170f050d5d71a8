// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures the costs of the parts of a step on samples of the world's models, and restores all
// state afterwards.

#include <algorithm>
#include <iterator>
#include <typeinfo>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "insight/explain.hh"
#include "insight/sensor_kinds.hh"
#include "models/body.hh"
#include "models/fiducial.hh"
#include "models/field.hh"
#include "models/gripper.hh"
#include "models/model_type.hh"
#include "models/position.hh"
#include "models/power_pack.hh"
#include "models/ranger.hh"
#include "models/state_exchange.hh"
#include "world/engine.hh"
#include "world/phases/field_phase.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// Bytes of the heap in use; 0 if the C library does not report them.
uint64_t HeapInUse() {
#ifdef __GLIBC__
#if __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
#endif
#endif
  return 0;
}

constexpr double kNanoseconds = 1e9;
constexpr size_t kProbeModels = 16;  // models in the first pass, which decides the sample size
constexpr size_t kMaxKinds = 12;     // kinds of sensors that are measured
constexpr size_t kMaxFields = 4;     // fields that are measured
constexpr int kMaxPasses = 2000;     // passes over a sample
constexpr uint64_t kSampleSeed = 1;

/// Returns `count` randomly chosen models, or all, in their original order. The choice is
/// repeatable, and a smaller sample is a subset of a larger one.
template <class M>
std::vector<M*> SomeOf(std::vector<M*> models, size_t count) {
  count = std::min(count, models.size());
  RandomStream random(kSampleSeed);
  for (size_t i = 0; i < count; i++)
    std::swap(models[i], models[i + static_cast<size_t>(random.Next() % (models.size() - i))]);
  models.resize(count);
  std::sort(models.begin(), models.end(),
            [](const M* a, const M* b) { return a->GetId() < b->GetId(); });
  return models;
}

/// Updates of other types may have effects that cannot be undone.
bool CanBePutBack(const Model& model) {
  const ModelType* const type = FindModelType(model);
  return type && type->measurable;
}

/// Simulates a minimal controller, which reads each range once.
double NearestRange(Model* model) {
  double nearest = 1e9;
  for (const ModelRanger::Sensor& sensor : static_cast<ModelRanger*>(model)->GetSensors())
    for (const double range : sensor.ranges) nearest = std::min(nearest, range);
  return nearest;
}

}  // namespace

/// A friend of Model, whose updates it repeats.
class StepCostMeter {
 public:
  explicit StepCostMeter(World& world)
      : world_(world), engine_(world.engine()), statistics_(engine_.tracer.statistics()) {
    engine_.TraceBatch();
    engine_.UseAllThreads();
    engine_.scheduler.Swap(scheduler_);
    engine_.tracer.ForcePath(sensing::BatchTracer::Path::kHost);
  }
  ~StepCostMeter() {
    engine_.tracer.ForcePath(sensing::BatchTracer::Path::kFaster);
    // Restores in reverse order because some models are saved twice.
    for (auto saved = saved_.rbegin(); saved != saved_.rend(); ++saved) PutBack(*saved);
    engine_.scheduler.Swap(scheduler_);
    statistics_.device = Statistics().device;  // the device may have failed
    engine_.tracer.SetStatistics(statistics_);
    engine_.fiducials->Forget(nullptr);  // finders have their previous sightings again
    engine_.fiducials->SetFrozen(false);
    engine_.lights->SetFrozen(false);
  }

  StepCosts Measure(double seconds) {
    const double start = WallClock();
    MeasureSensors(seconds * 0.75);
    MeasurePositions(seconds * 0.05);
    MeasureMoves(seconds * 0.15);
    MeasureEnergy(seconds * 0.05);
    MeasureFields(seconds * 0.05);
    costs_.rays = Statistics().trace.rays - statistics_.trace.rays;
    const uint64_t device_rays = Statistics().device_rays - statistics_.device_rays;
    if (device_rays > 0)
      costs_.device_bytes_per_ray = static_cast<double>(Statistics().prefilter.bytes_fetched -
                                                        statistics_.prefilter.bytes_fetched) /
                                    static_cast<double>(device_rays);
    if (best_seconds_ > 0) costs_.busy = total_seconds_ / best_seconds_;
    costs_.seconds = WallClock() - start;
    return costs_;
  }

 private:
  struct Pass {
    double update = 0, trace = 0;  // seconds
    uint64_t rays = 0;
  };

  // ---- sensors ----

  void MeasureSensors(double seconds) {
    const std::vector<SensorGroup> groups = SortSensors(engine_.models, world_.sim_interval);
    costs_.sensors.resize(groups.size());
    const auto subscribed = static_cast<size_t>(std::count_if(
        groups.begin(), groups.end(), [](const SensorGroup& g) { return g.kind.subscribed; }));
    const size_t count = std::min(subscribed, kMaxKinds);
    double all_rays = 0;
    for (size_t i = 0; i < count; i++) all_rays += groups[i].kind.RaysPerStep();
    // Half of the time is divided equally, the other half in proportion to the rays.
    for (size_t i = 0; i < count; i++) {
      const double fraction = 0.5 / static_cast<double>(count) +
                              (all_rays > 0 ? 0.5 * groups[i].kind.RaysPerStep() / all_rays : 0);
      MeasureKind(groups[i].models, seconds * fraction, &costs_.sensors[i]);
    }
  }

  void MeasureKind(std::vector<Model*> models, double seconds, SensorCost* cost) {
    std::erase_if(models, [](Model* model) { return !CanMeasure(model); });
    if (models.empty()) return;
    std::vector<Model*> sample = SomeOf(models, kProbeModels);
    const uint64_t heap = HeapInUse();
    const Pass probe = FirstPasses(sample);
    cost->kept_bytes = (HeapInUse() - std::min(heap, HeapInUse())) / sample.size();
    const double taken = probe.update + probe.trace;
    if (taken > seconds) {  // a sample with millions of rays: one pass must suffice
      Write({probe.update, probe.trace, static_cast<double>(probe.rays)}, sample.size(), cost);
      return;
    }
    const double each = taken / static_cast<double>(sample.size());
    // Each path (host, device) takes two warm-up passes and at least three that count.
    const double fitting = seconds / ((HasDevice() ? 10 : 5) * std::max(each, 1e-9));
    if (fitting > static_cast<double>(sample.size()) && sample.size() < models.size()) {
      const double all = static_cast<double>(models.size());
      sample = SomeOf(models, static_cast<size_t>(std::min(fitting, all)));
      FirstPasses(sample);
    }
    TimePasses(sample, each, seconds, cost);
    const Model& first = *sample[0];
    if (typeid(first) == typeid(ModelRanger)) MeasureReading(sample, cost);
  }

  struct Saved {
    Model* model;
    uint64_t update_generation;
    StateExchange::Bytes state;
    std::vector<uint64_t> stamps;  // stamps of its bodies
  };

  struct PathCost {
    double update, trace;  // seconds
    double rays;
  };

  static void Write(const PathCost& path, size_t models, SensorCost* cost) {
    const double count = static_cast<double>(models);
    cost->sample = models;
    cost->rays = path.rays / count;
    cost->update_ns = path.update / count * kNanoseconds;
    cost->ray_ns = path.rays > 0 ? path.trace / path.rays * kNanoseconds : 0;
  }

  const sensing::TraceStatistics& Statistics() const { return engine_.tracer.statistics(); }
  bool HasDevice() const { return !Statistics().device.empty(); }

  static bool CanMeasure(Model* model) {
    if (!CanBePutBack(*model)) return false;
    auto* gripper = dynamic_cast<ModelGripper*>(model);
    return !gripper || !gripper->GetConfig().gripped;  // a restored gripper would drop it
  }

  /// Runs two passes and returns the second. The first one allocates readings, layers and tables.
  Pass FirstPasses(const std::vector<Model*>& sample) {
    for (Model* model : sample) Save(model);
    Run(sample);
    return Run(sample);
  }

  /// Saves the model's state, its pending update and the stamps of its bodies, to be restored by
  /// PutBack().
  void Save(Model* model) {
    Saved saved{model, model->update_generation_, {}, {}};
    StateExchange exchange(engine_.models, &saved.state);
    model->ExchangeState(exchange);
    exchange.Finish();
    model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>&) {
      saved.stamps.push_back(engine_.scene.grid.Stamp(id));
    });
    saved_.push_back(std::move(saved));
  }

  void PutBack(const Saved& saved) {
    StateExchange exchange(engine_.models, saved.state.data(), saved.state.size());
    saved.model->ExchangeState(exchange);
    saved.model->update_generation_ = saved.update_generation;
    size_t i = 0;
    saved.model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& sets) {
      if (i < saved.stamps.size()) engine_.scene.grid.Restamp(id, saved.stamps[i++], sets);
    });
  }

  /// Updates the models and traces their rays, as in a step, but calls no callbacks.
  Pass Run(const std::vector<Model*>& sample) {
    const ModelType* const type = FindModelType(*sample[0]);
    engine_.fiducials->SetFrozen(type && type->updates != ModelType::kSerial);
    engine_.lights->SetFrozen(type && type->updates != ModelType::kSerial);
    Pass pass;
    const double start = WallClock();
    for (Model* model : sample) model->Update();
    const double updated = WallClock();
    pass.rays = engine_.scene.batch.ray_count();
    engine_.TraceBatch();
    pass.trace = WallClock() - updated;
    pass.update = updated - start;
    engine_.update_callbacks_due.clear();
    engine_.sensed.clear();
    return pass;
  }

  /// `each` is the approximate time that one model takes, in seconds.
  void TimePasses(const std::vector<Model*>& sample, double each, double seconds,
                  SensorCost* cost) {
    const bool device = HasDevice();
    const double count = static_cast<double>(sample.size());
    // Timing small pieces finds undisturbed passes even on a busy machine. Threads and devices need
    // the whole sample, and fiducial finders share work between models.
    constexpr double kPiece = 0.002;  // seconds
    const Model& first = *sample[0];
    const bool whole = engine_.threads() > 1 || typeid(first) == typeid(ModelFiducial);
    const double piece = whole ? count : kPiece / std::max(each, 1e-9);
    const PathCost host = TimePath(sensing::BatchTracer::Path::kHost, sample,
                                   static_cast<size_t>(std::clamp(piece, 1.0, count)),
                                   device ? seconds / 2 : seconds);
    Write(host, sample.size(), cost);
    if (!device) return;
    const PathCost other =
        TimePath(sensing::BatchTracer::Path::kDevice, sample, sample.size(), seconds / 2);
    // If the device fails, the engine continues without it.
    if (HasDevice() && other.rays > 0)
      cost->device_ray_ns = other.trace / other.rays * kNanoseconds;
  }

  /// Sums the best times of the pieces of the sample.
  PathCost TimePath(sensing::BatchTracer::Path path, const std::vector<Model*>& sample,
                    size_t piece, double seconds) {
    std::vector<std::vector<Model*>> pieces;
    for (size_t i = 0; i < sample.size(); i += piece)
      pieces.emplace_back(
          sample.begin() + static_cast<std::ptrdiff_t>(i),
          sample.begin() + static_cast<std::ptrdiff_t>(std::min(i + piece, sample.size())));
    std::vector<Pass> best(pieces.size());
    engine_.tracer.ForcePath(path);
    for (const auto& models : pieces) Run(models);  // to warm up
    const double end = WallClock() + seconds;
    int passes = 0;
    for (; passes < kMaxPasses && (passes < 3 || WallClock() < end); passes++)
      for (size_t p = 0; p < pieces.size(); p++) KeepBest(Run(pieces[p]), passes == 0, &best[p]);
    engine_.tracer.ForcePath(sensing::BatchTracer::Path::kHost);
    PathCost cost{0, 0, 0};
    for (const Pass& pass : best) {
      cost.update += pass.update;
      cost.trace += pass.trace;
      cost.rays += static_cast<double>(pass.rays);
    }
    best_seconds_ += passes * (cost.update + cost.trace);
    return cost;
  }

  void KeepBest(const Pass& pass, bool first, Pass* best) {
    total_seconds_ += pass.update + pass.trace;
    best->update = first ? pass.update : std::min(best->update, pass.update);
    best->trace = first ? pass.trace : std::min(best->trace, pass.trace);
    best->rays = pass.rays;
  }

  void MeasureReading(const std::vector<Model*>& sample, SensorCost* cost) {
    double (*volatile probe)(Model*) =
        NearestRange;  // through a pointer, so that the call is not inlined
    volatile double result = 0;
    cost->read_ns = Repeat(0, sample.size(), [&] {
      const double start = WallClock();
      for (Model* model : sample) result = probe(model);
      return WallClock() - start;
    });
    static_cast<void>(result);
  }

  // ---- robots ----

  /// Calls pass() until the time is over. Returns its shortest time divided by `count`, in
  /// nanoseconds.
  template <typename F>
  double Repeat(double seconds, size_t count, F pass) {
    pass();  // to warm up
    double best = -1;
    const double end = WallClock() + seconds;
    int passes = 0;
    for (; passes < kMaxPasses && (passes < 3 || WallClock() < end); passes++) {
      const double time = pass();
      best = best < 0 ? time : std::min(best, time);
      total_seconds_ += time;
    }
    best_seconds_ += passes * best;
    return best / static_cast<double>(count) * kNanoseconds;
  }

  template <typename F>
  static double TimeEach(const std::vector<ModelPosition*>& sample, F f) {
    const double start = WallClock();
    for (ModelPosition* robot : sample) f(robot);
    return WallClock() - start;
  }

  void MeasurePositions(double seconds) {
    std::vector<ModelPosition*> sample;
    for (Model* model : engine_.models) {
      if (typeid(*model) != typeid(ModelPosition) || !model->HasSubscribers()) continue;
      auto* robot = static_cast<ModelPosition*>(model);
      // Cars may print messages, and velocity callbacks must not be called.
      const bool quiet =
          robot->drive_mode != ModelPosition::DRIVE_CAR && !robot->HasCallbacks(Model::CB_VELOCITY);
      if (quiet) sample.push_back(robot);
    }
    sample = SomeOf(sample, 1000);
    costs_.position_sample = sample.size();
    if (sample.empty()) return;
    for (ModelPosition* robot : sample) Save(robot);
    costs_.position_ns = Repeat(seconds, sample.size(), [&] {
      const double time = TimeEach(sample, [](Model* robot) { robot->Update(); });
      engine_.update_callbacks_due.clear();
      return time;
    });
  }

  /// Top-level robots that share no cell with other models. Moving them back restores the grid
  /// exactly.
  std::vector<ModelPosition*> Movable() const {
    std::vector<ModelPosition*> robots;
    for (Model* model : engine_.moving)
      if (typeid(*model) == typeid(ModelPosition) && !model->Parent() && model->IsEnabled() &&
          IsAlone(*model))
        robots.push_back(static_cast<ModelPosition*>(model));
    return robots;
  }

  bool IsAlone(const Model& model) const {
    const grid::Grid& grid = engine_.scene.grid;
    grid::Rasterizations rasterizations;
    model.CollectRasterizations(&rasterizations, false);
    const auto is_other = [&](grid::BodyId id) { return grid.body(id).tree != model.Root(); };
    bool alone = true;
    rasterizations.ForEachCell(
        [&](grid::CellRef cell) { alone = alone && !grid.AnyIn(cell, is_other); });
    return alone;
  }

  struct Place {
    Pose pose;
    Velocity velocity;
    bool stall;
  };

  /// Measures moves at half the maximum speeds.
  void MeasureMoves(double seconds) {
    const std::vector<ModelPosition*> sample = SomeOf(Movable(), 300);
    costs_.move_sample = sample.size();
    if (sample.empty()) return;
    std::vector<Place> places;
    for (ModelPosition* robot : sample) {
      Save(robot);
      places.push_back({robot->pose, robot->velocity, robot->stall});
    }
    costs_.move_ns = Repeat(seconds, sample.size(), [&] {
      for (ModelPosition* robot : sample)
        robot->velocity =
            Velocity(robot->velocity_bounds[0].max / 2, 0, 0, robot->velocity_bounds[3].max / 2);
      const double time = TimeEach(sample, [](ModelPosition* robot) { robot->Move(); });
      Return(sample, places);
      return time;
    });
  }

  static void Return(const std::vector<ModelPosition*>& robots, const std::vector<Place>& places) {
    for (size_t i = 0; i < robots.size(); i++) {
      robots[i]->pose = places[i].pose;
      robots[i]->velocity = places[i].velocity;
      robots[i]->stall = places[i].stall;
      robots[i]->Map();
    }
  }

  // ---- energy ----

  /// Measures finding the power pack and, for chargers, the touching models. Transfers no energy.
  void MeasureEnergy(double seconds) {
    const std::vector<Model*> sample = SomeOf(engine_.energy, 1000);
    costs_.energy_sample = sample.size();
    if (sample.empty()) return;
    std::vector<Model*> touching;
    costs_.energy_ns = Repeat(seconds, sample.size(), [&] {
      const double start = WallClock();
      for (const Model* model : sample) {
        touching.clear();
        if (model->FindPowerPack() && model->watts_give > 0) model->AppendTouchingModels(&touching);
      }
      return WallClock() - start;
    });
  }

  // ---- fields ----

  void MeasureFields(double seconds) {
    std::vector<const ModelField*> sample;
    for (const ModelField* field : engine_.fields) {
      if (sample.size() == kMaxFields) break;
      if (field->diffusion() == 0 && field->evaporation() == 0) continue;
      sample.push_back(field);
      costs_.field_sample += field->values().size();
    }
    if (sample.empty()) return;
    costs_.field_cell_ns = Repeat(seconds, costs_.field_sample, [&] {
      double time = 0;
      for (const ModelField* field : sample) time += FieldPhase::MeasureUpdate(*field, &engine_);
      return time;
    });
  }

  World& world_;
  WorldEngine& engine_;
  Scheduler scheduler_;  // holds the pending events while updates are measured
  sensing::TraceStatistics statistics_;
  std::vector<Saved> saved_;
  double total_seconds_ = 0;  // seconds of all tries
  double best_seconds_ = 0;   // the same, if each try had been as fast as the fastest one
  StepCosts costs_;
};

StepCosts MeasureStepCosts(World& world, double seconds) {
  return StepCostMeter(world).Measure(seconds);
}

}  // namespace Stg
