// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs of worlds that Python steps.

#ifndef STAGE_PYTHON_RUN_LOG_HH
#define STAGE_PYTHON_RUN_LOG_HH

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "messages/report.hh"
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

/// Prevents two logs of this process from writing the same file at once.
class WrittenFile {
 public:
  /// Throws Failure if another log writes the file.
  explicit WrittenFile(const std::string& file);
  ~WrittenFile() { Release(); }
  WrittenFile(const WrittenFile&) = delete;
  WrittenFile& operator=(const WrittenFile&) = delete;

  void Release();

 private:
  std::string path_;
};

/// The log of a run. It keeps the world's Simulation alive.
class RunLog {
 public:
  /// Creates the file; see recording::Recorder. `keep` is called when the log is complete.
  RunLog(std::shared_ptr<Simulation> simulation, const recording::LogOptions& options,
         std::function<void()> keep)
      : simulation_(std::move(simulation)),
        file_(options.file),
        recorder_(options),
        keep_(std::move(keep)) {}

  Source& source() const { return *simulation_; }
  void Attach(World* world) { recorder_.Attach(world); }
  /// Closes the log, once. The caller holds a Use of the source. The world may have been deleted
  /// before.
  void Complete() {
    if (std::exchange(finished_, true)) return;
    file_.Release();
    Failing([&] {
      recorder_.Finish();
      keep_();
    });
  }

 private:
  const std::shared_ptr<Simulation> simulation_;
  WrittenFile file_;
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
      : batch_(std::move(batch)), world_(world), file_(options.file), recorder_(options) {}

  Source& source() const;
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
  /// Closes the log, once. The caller holds a Use of the source.
  void Complete();

 private:
  const std::shared_ptr<Batch> batch_;
  const uint32_t world_;
  WrittenFile file_;
  recording::Recorder recorder_;
  usec_t before_ = 0;  // time of the world before the step
  bool finished_ = false;
};

/// Throws Failure if the file can't be written or the log's source is in use.
template <typename Log>
void Finish(Log* log) {
  const Source::Use use(&log->source());
  log->Complete();
}

/// Closes a log that nobody refers to any more: now, or when its source is free. Failures become
/// warnings.
template <typename Log>
void FinishWhenFree(const std::shared_ptr<Log>& log) {
  log->source().CallWhenFree([log] {
    try {
      log->Complete();
    } catch (const Failure& failure) {
      messages::Warn(failure.text);
    }
  });
}

}  // namespace Stg::python

#endif
