// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs of worlds and of the worlds of batches: see stagesim/log.py.

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <string>
#include <vector>

#include "batch.hh"
#include "bindings.hh"
#include "recording/recorder.hh"
#include "run_log.hh"
#include "text.hh"

namespace Stg::python {

namespace {

using recording::Compression;

/// Throws Failure if Stage was built without it. "": the default one.
Compression CompressionOf(const std::string& name) {
  if (name.empty()) return recording::DefaultCompression();
  for (const Compression compression : {Compression::kLz4, Compression::kZstd}) {
    if (name != recording::NameOf(compression)) continue;
    if (recording::IsAvailable(compression)) return compression;
    throw Failure{Kind::kStage,
                  "found the compression " + name + ", but Stage was built without it"};
  }
  return Compression::kNone;
}

recording::LogOptions OptionsOf(const std::string& file, uint64_t every,
                                const std::vector<std::string>& models,
                                const std::string& compression, bool by_rep_117) {
  recording::LogOptions options;
  options.file = file;
  options.every = every;
  options.robots = models;
  options.robots_option = "models";
  options.compression = CompressionOf(compression);
  options.ranges =
      by_rep_117 ? recording::RangeConvention::kRep117 : recording::RangeConvention::kStage;
  return options;
}

std::shared_ptr<RunLog> StartLog(Simulation& simulation, const std::string& file, uint64_t every,
                                 const std::vector<std::string>& models,
                                 const std::string& compression, bool by_rep_117) {
  const recording::LogOptions options = OptionsOf(file, every, models, compression, by_rep_117);
  return simulation.With([&](World& world) {
    return Failing([&] {
      auto log = std::make_shared<RunLog>(simulation.shared_from_this(), options, [] {});
      log->Attach(&world);
      return log;
    });
  });
}

template <typename Log>
void BindEnds(nb::class_<Log> log) {
  log.def("finish", [](Log& self) { Logged([&] { Finish(&self); }); });
  log.def("finish_when_free",
          [](const std::shared_ptr<Log>& self) { Logged([&] { FinishWhenFree(self); }); });
}

}  // namespace

void BindLog(nb::module_& module, nb::class_<Simulation>& world) {
  BindEnds(nb::class_<RunLog>(module, "RunLog", "The log of a run; see stagesim.Log."));
  BindEnds(
      nb::class_<BatchLog>(module, "BatchLog", "The log of a world of a batch; see stagesim.Log."));
  world.def("start_log", &StartLog, nb::arg("file"), nb::arg("every"), nb::arg("models"),
            nb::arg("compression"), nb::arg("by_rep_117"));
}

void BindLog(nb::class_<Batch>& batch) {
  batch.def(
      "start_log",
      [](Batch& b, uint32_t index, const std::string& file, uint64_t every,
         const std::vector<std::string>& models, const std::string& compression, bool by_rep_117) {
        return b.StartLog(index, OptionsOf(file, every, models, compression, by_rep_117));
      },
      nb::arg("index"), nb::arg("file"), nb::arg("every"), nb::arg("models"),
      nb::arg("compression"), nb::arg("by_rep_117"));
}

}  // namespace Stg::python
