// SPDX-License-Identifier: GPL-2.0-or-later
//
// Functions for the workers of sweeps, whose records must equal those of the program `stage`.

#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bindings.hh"
#include "models/host.hh"
#include "recording/mcap_reader.hh"
#include "recording/recorder.hh"
#include "recording/ros_messages.hh"
#include "simulation.hh"
#include "text.hh"
#include "world/statistics.hh"

namespace Stg::python {

namespace {

/// Statistics of a run. Only position models with subscribers count as robots.
nb::dict FiguresOf(Simulation& simulation) {
  return simulation.With([](World& world) {
    const RunStatistics run = world.statistics();
    const EnergyTotals& totals = world.energy_totals();
    const auto is_robot = [](const Model* model) {
      return dynamic_cast<const ModelPosition*>(model) && model->HasSubscribers();
    };
    const std::vector<Model*>& models = world.host().models;
    nb::dict energy, figures;
    energy["stored"] = totals.stored;
    energy["dissipated"] = totals.dissipated;
    energy["input"] = totals.input;
    figures["steps"] = run.steps;
    figures["rays"] = run.trace.rays;
    figures["robots"] = std::count_if(models.begin(), models.end(), is_robot);
    figures["energy"] = energy;
    figures["load_seconds"] = run.load_seconds;
    return figures;
  });
}

/// Calls f() and turns a std::runtime_error into a Failure.
template <typename F>
void Recording(F f) {
  try {
    f();
  } catch (const std::runtime_error& error) {
    throw Failure{Kind::kStage, error.what()};
  }
}

recording::Compression CompressionCalled(const std::string& name) {
  using recording::Compression;
  for (const Compression compression : {Compression::kLz4, Compression::kZstd})
    if (name == recording::NameOf(compression) && recording::IsAvailable(compression))
      return compression;
  if (name == "none") return Compression::kNone;
  throw Failure{Kind::kStage, "found the compression '" + name +
                                  "', expected none, lz4 or zstd, and one that was built in"};
}

recording::RangeConvention RangesCalled(const std::string& name) {
  if (name == "rep117") return recording::RangeConvention::kRep117;
  if (name == "stage") return recording::RangeConvention::kStage;
  throw Failure{Kind::kStage, "found the ranges '" + name + "', expected rep117 or stage"};
}

/// An MCAP log of a world. It keeps the world's Simulation alive.
class WorldLog {
 public:
  WorldLog(std::shared_ptr<Simulation> simulation, const recording::LogOptions& options)
      : simulation_(std::move(simulation)), recorder_(options) {}

  void Attach(World* world) { recorder_.Attach(world); }
  /// Closes the log. The world may have been deleted before.
  void Finish() {
    const Source::Use use(simulation_.get());
    recorder_.Finish();
  }

 private:
  const std::shared_ptr<Simulation> simulation_;
  recording::Recorder recorder_;
};

/// Starts a log. `every` is its period in simulated seconds; without it, each update is logged.
std::shared_ptr<WorldLog> Record(Simulation& simulation, const std::string& file,
                                 std::optional<double> every,
                                 const std::vector<std::string>& robots,
                                 const std::string& compression, const std::string& ranges) {
  return simulation.With([&](World& world) {
    recording::LogOptions options;
    options.file = file;
    options.every = static_cast<usec_t>(every.value_or(0) * 1e6 + 0.5);
    options.robots = robots;
    options.compression = CompressionCalled(compression);
    options.ranges = RangesCalled(ranges);
    std::shared_ptr<WorldLog> log;
    Recording([&] {
      log = std::make_shared<WorldLog>(simulation.shared_from_this(), options);
      log->Attach(&world);
    });
    return log;
  });
}

/// The positions of moving models at all moments of a log: pairs of x and y in metres, as doubles.
nb::bytes PlacesInLog(const std::string& file) {
  std::vector<double> places;
  Recording([&] {
    const recording::McapReader log(file);
    recording::Buffer records;
    std::vector<recording::ModelPose> poses;
    bool first = true;  // the first message is skipped: it also has the models that never move
    for (const recording::McapReader::Chunk& chunk : log.chunks()) {
      log.Read(chunk, &records);
      recording::ForEachRecord(records.view(), [&](recording::Op op, std::string_view record) {
        if (op != recording::Op::kMessage) return;
        const recording::Message message = recording::MessageOf(record);
        const auto channel = log.channels().find(message.channel);
        if (channel == log.channels().end() || channel->second.topic != "/stage/poses") return;
        if (!recording::GetModelPoses(message.data, &poses) || std::exchange(first, false)) return;
        for (const recording::ModelPose& pose : poses)
          if (pose.parent == 0) places.insert(places.end(), {pose.pose.x, pose.pose.y});
      });
    }
  });
  return nb::bytes(reinterpret_cast<const char*>(places.data()), places.size() * sizeof(double));
}

}  // namespace

void BindSweep(nb::module_& module, nb::class_<Simulation>& world) {
  module.def("mix_seeds", &MixSeeds, nb::arg("seed"), nb::arg("part"));
  module.def(
      "set_controller_arguments", [](const std::string& text) { World::ctrlargs = text; },
      nb::arg("text"));
  module.def("places_in_log", &PlacesInLog, nb::arg("file"));
  nb::class_<WorldLog>(module, "Recorder", "Writes a log of a world, like stage --log.")
      .def("finish", [](WorldLog& log) { Recording([&] { log.Finish(); }); });
  world.def("figures", &FiguresOf)
      .def("record", &Record, nb::arg("file"), nb::arg("every").none(), nb::arg("robots"),
           nb::arg("compression"), nb::arg("ranges"));
}

}  // namespace Stg::python
