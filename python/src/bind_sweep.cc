// SPDX-License-Identifier: GPL-2.0-or-later
//
// The part of the program `stage` that workers of sweeps need: plan, records and logs.

#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bindings.hh"
#include "recording/mcap_reader.hh"
#include "recording/ros_messages.hh"
#include "run_log.hh"
#include "simulation.hh"
#include "stage/sweep/folder.hh"
#include "stage/sweep/record.hh"

namespace Stg::python {

namespace {

/// The folder of a sweep, for workers.
class Sweep {
 public:
  explicit Sweep(const std::string& folder)
      : folder_(folder), plan_(Failing([&] { return folder_.Read(); })) {}

  const program::Plan& plan() const { return plan_; }

  /// Indices of runs with a record.
  std::vector<uint64_t> Finished() const {
    const std::vector<bool> has_record = Failing([&] { return folder_.Finished(plan_); });
    std::vector<uint64_t> indices;
    for (uint64_t i = 0; i < has_record.size(); i++)
      if (has_record[i]) indices.push_back(i);
    return indices;
  }

  /// The arguments of World() for a run.
  std::map<std::string, OptionValue> OptionsOf(uint64_t index) const {
    return ValuesOf(RunOptionsOf(plan_, RunAt(plan_, index)));
  }

  /// Returns null if the sweep has no logs.
  std::shared_ptr<RunLog> StartLog(uint64_t index, Simulation& simulation) const {
    if (!plan_.log) return nullptr;
    return simulation.With([&](World& world) {
      return Failing([&] {
        recording::LogOptions options = *plan_.log;
        options.file = folder_.StartLog(index);
        auto log = std::make_shared<RunLog>(simulation.shared_from_this(), options,
                                            [folder = folder_, index] { folder.KeepLog(index); });
        log->Attach(&world);
        return log;
      });
    });
  }

  void WriteRecord(uint64_t index, Simulation& simulation, int attempt, double wall_seconds,
                   const program::OwnMetrics& metrics) const {
    simulation.With([&](World& world) {
      Failing([&] {
        folder_.WriteRecord(
            index, RecordOf(plan_, RunAt(plan_, index), &world, wall_seconds, attempt, metrics));
      });
    });
  }

 private:
  program::SweepFolder folder_;
  program::Plan plan_;
};

/// The positions of moving models at all moments of a log: pairs of x and y in metres, as doubles.
nb::bytes PlacesInLog(const std::string& file) {
  std::vector<double> places;
  Failing([&] {
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

void BindSweep(nb::module_& module) {
  module.def(
      "set_controller_arguments", [](const std::string& text) { World::ctrlargs = text; },
      nb::arg("text"));
  module.def(
      "make_sweep_folder",
      [](const std::string& path) { Failing([&] { program::SweepFolder(path).Make(); }); },
      nb::arg("path"));
  module.def("places_in_log", &PlacesInLog, nb::arg("file"));
  nb::class_<Sweep>(module, "Sweep", "The folder of a sweep, for workers.")
      .def(nb::init<std::string>(), nb::arg("folder"))
      .def_prop_ro("world", [](const Sweep& sweep) { return sweep.plan().world; })
      .def_prop_ro("controller_arguments",
                   [](const Sweep& sweep) { return sweep.plan().controller_args; })
      .def_prop_ro(
          "duration",
          [](const Sweep& sweep) { return FindRunOption("duration").get(sweep.plan().run); })
      .def("finished", &Sweep::Finished)
      .def("options", &Sweep::OptionsOf, nb::arg("index"))
      .def("start_log", &Sweep::StartLog, nb::arg("index"), nb::arg("world"))
      .def("write_record", &Sweep::WriteRecord, nb::arg("index"), nb::arg("world"),
           nb::arg("attempt"), nb::arg("wall_seconds"), nb::arg("metrics"));
}

}  // namespace Stg::python
