// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs of worlds that Python steps.

#ifndef STAGE_PYTHON_RUN_LOG_HH
#define STAGE_PYTHON_RUN_LOG_HH

#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>

#include "recording/recorder.hh"
#include "simulation.hh"
#include "text.hh"

namespace Stg::python {

/// Calls f() and turns a std::runtime_error into a Failure.
template <typename F>
auto Failing(F f) {
  try {
    return f();
  } catch (const std::runtime_error& error) {
    throw Failure{Kind::kStage, error.what()};
  }
}

/// The log of a run. It keeps the world's Simulation alive.
class RunLog {
 public:
  /// Creates the file; see recording::Recorder. `keep` is called when the log is complete.
  RunLog(std::shared_ptr<Simulation> simulation, const recording::LogOptions& options,
         std::function<void()> keep)
      : simulation_(std::move(simulation)), recorder_(options), keep_(std::move(keep)) {}

  void Attach(World* world) { recorder_.Attach(world); }
  /// Closes the log, once. The world may have been deleted before.
  void Finish() {
    const Source::Use use(simulation_.get());
    if (std::exchange(finished_, true)) return;
    Failing([&] {
      recorder_.Finish();
      keep_();
    });
  }

 private:
  const std::shared_ptr<Simulation> simulation_;
  recording::Recorder recorder_;
  const std::function<void()> keep_;
  bool finished_ = false;
};

class Batch;

/// The log of a world of a batch, which it keeps alive. The batch calls it; see
/// Batch::StepLogged().
class BatchLog {
 public:
  BatchLog(std::shared_ptr<Batch> batch, uint32_t world, const recording::LogOptions& options)
      : batch_(std::move(batch)), world_(world), recorder_(options) {}

  uint32_t world() const { return world_; }
  void Begin(World* world) { recorder_.Begin(world); }
  void BeforeStep(World* world) {
    before_ = world->SimTimeNow();
    recorder_.BeforeStep(world);
  }
  /// Does nothing if the world has not made the step.
  void AfterStep(World* world) {
    if (world->SimTimeNow() > before_) recorder_.AfterStep(world);
  }
  bool finished() const { return finished_; }
  void Finish();

 private:
  const std::shared_ptr<Batch> batch_;
  const uint32_t world_;
  recording::Recorder recorder_;
  usec_t before_ = 0;  // time of the world before the step
  bool finished_ = false;
};

}  // namespace Stg::python

#endif
