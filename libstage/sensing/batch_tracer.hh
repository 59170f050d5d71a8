// SPDX-License-Identifier: GPL-2.0-or-later
//
// Traces the batch of a step: a device or the host walks the rays, predicates decide on the host,
// and sensors receive the hits.

#ifndef STAGE_SENSING_BATCH_TRACER_HH
#define STAGE_SENSING_BATCH_TRACER_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sensing/counters.hh"
#include "sensing/fan_order.hh"
#include "sensing/path_chooser.hh"
#include "sensing/prefilter.hh"
#include "sensing/ray_hit.hh"
#include "sensing/scene.hh"
#include "sensing/tracer.hh"
#include "threads/worker_pool.hh"

namespace Stg::internal::sensing {

class BatchTracer {
 public:
  /// Traces batches of this scene, which must outlive the tracer.
  explicit BatchTracer(Scene* scene) : scene_(*scene) {}
  ~BatchTracer();

  /// Sets the threads to trace with. Must be called before the first Trace().
  void SetWorkers(threads::WorkerPool* workers);
  /// Null means no device. `always`: send every batch that fits the device to it.
  void SetPrefilter(std::unique_ptr<Prefilter> prefilter, bool always);
  /// Uses the device of another tracer, if it has one that can be shared.
  void SharePrefilterOf(const BatchTracer& other, bool always);
  /// Keeps the prefilter when a new world begins. Returns false if there is none.
  bool KeepPrefilter(bool always);

  /// The view of rangers is uniform if all bodies that they may see have the same ranger_return,
  /// and the grid shows exactly these to them. Then a device can find their ranges.
  struct RangerView {
    bool is_uniform = false;
    double ranger_return = 0;
  };
  /// Sets how to find out, before a batch goes to the device. Without it, devices give hit lists.
  void SetRangerView(std::function<RangerView()> find) { find_ranger_view_ = std::move(find); }

  /// The path that batches take: the faster one or, for measurements, a fixed one.
  enum class Path { kFaster, kHost, kDevice };
  void ForcePath(Path path) { path_ = path; }

  /// Traces the scene's batch, passes the hits to their sinks and empties the batch.
  void Trace();
  /// Empties the batch without tracing it.
  void Drop() noexcept;
  /// Sends the changes of the grid so far to a device in use. Call it while callbacks run that do
  /// not change the grid: bodies have moved and mostly stay in place until the next batch.
  void SendAhead();

  /// Gives the observer a record of this ray before each batch that contains it, be it a sample of
  /// the fan with the first tag or all of the fan with the tag `alone`. Null ends the observation.
  void Observe(const Model* finder, uint32_t tag, uint32_t sample, uint32_t alone,
               RayObserver* observer) {
    observed_ = {finder, tag, sample, alone, observer};
  }

  const TraceStatistics& statistics() const { return statistics_; }
  /// Wall-clock time spent so far, in seconds.
  double seconds() const { return statistics_.prefilter_seconds + statistics_.trace_seconds; }
  void SetStatistics(const TraceStatistics& statistics) { statistics_ = statistics; }

 private:
  struct alignas(64) ThreadData {  // aligned, because each thread writes to its own all the time
    Tracer::Hits hits;             // of the rays traced together
    TraceCounters counters;
  };
  class Probe;

  void RecordObserved() const;
  void TraceAll(bool on_device, bool choosing);
  bool TraceWithProbe(bool probe_device);
  void TraceProbe(const Probe& probe, bool probe_device);
  void ExcludeOthersFromDevice(const Probe& probe);
  void TraceOnDevice();
  void AskForRanges();
  HitLists Prefilter(uint64_t rays);
  std::size_t WaitFor(std::size_t fan, HitLists* lists);
  void LoseDevice(const PrefilterError& error);
  template <typename At>
  void TraceIntervals(const HitLists& lists, std::size_t count, At at);
  void TraceInterval(const Tracer& tracer, const FanInterval& interval, const HitLists& lists,
                     ThreadData* mine) const;
  void TraceFans(const Tracer& tracer, std::span<const Fan> fans, const HitLists& lists,
                 ThreadData* mine) const;
  void PassRanges(const Tracer& tracer, const Fan& fan, const HitLists& lists,
                  ThreadData* mine) const;
  void SumCounters();
  std::size_t CountRays(const FanInterval& interval) const;
  uint64_t CountRays(const Probe& probe) const;
  void ReleaseDevice();

  Scene& scene_;
  threads::WorkerPool* workers_ = nullptr;
  std::vector<ThreadData> thread_data_;
  FanOrder fan_order_;
  std::unique_ptr<sensing::Prefilter> prefilter_;
  PathChooser chooser_;
  Path path_ = Path::kFaster;
  bool device_in_use_ = false;  // for the last batch
  std::function<RangerView()> find_ranger_view_;
  double ranger_return_ = 0;  // of all that is hit by rays whose ranges the device finds
  struct Observed {
    const Model* finder = nullptr;
    uint32_t tag = 0, sample = 0, alone = 0;
    RayObserver* observer = nullptr;
  } observed_;
  TraceStatistics statistics_;
};

}  // namespace Stg::internal::sensing

#endif
