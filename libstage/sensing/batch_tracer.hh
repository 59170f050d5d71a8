// SPDX-License-Identifier: GPL-2.0-or-later
//
// What becomes of the batch of a step: a device or the host walks its rays, the predicates decide
// on the host, and the hits go to the sensors.

#ifndef STAGE_SENSING_BATCH_TRACER_HH
#define STAGE_SENSING_BATCH_TRACER_HH

#include <cstddef>
#include <cstdint>
#include <memory>
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
  /// Of this scene's batches; the scene outlives it.
  explicit BatchTracer(Scene* scene) : scene_(*scene) {}
  ~BatchTracer();

  /// These share the work, until it is told otherwise; before that nothing can be traced.
  void SetWorkers(threads::WorkerPool* workers);
  /// Null: none. `always`: every batch that fits a device goes there.
  void SetPrefilter(std::unique_ptr<Prefilter> prefilter, bool always);
  /// One on the device of another tracer, if it has one that can be shared.
  void SharePrefilterOf(const BatchTracer& other, bool always);
  /// Goes on with the one there is, in a world that begins anew. False if there is none.
  bool KeepPrefilter(bool always);

  /// Which path batches take: the faster one, or, for measurements, one of the two.
  enum class Path { kFaster, kHost, kDevice };
  void ForcePath(Path path) { path_ = path; }

  /// Traces the rays of the scene's batch and hands the hits to their sinks; empties the batch.
  void Trace();
  /// Empties the batch.
  void Drop() noexcept;
  /// While callbacks run that leave the grid alone: bodies have moved, and mostly stay where they
  /// are until the next batch. Sends a device that is in use what has changed so far.
  void SendAhead();

  /// Before a batch is traced that has a ray of this finder, tag and sample, the observer gets its
  /// record. Null: nobody wants any.
  void Observe(const Model* finder, uint32_t tag, uint32_t sample, RayObserver* observer) {
    observed_ = {finder, tag, sample, observer};
  }

  const TraceStatistics& statistics() const { return statistics_; }
  /// That it took so far, of the wall clock.
  double seconds() const { return statistics_.prefilter_seconds + statistics_.trace_seconds; }
  void SetStatistics(const TraceStatistics& statistics) { statistics_ = statistics; }

 private:
  struct alignas(64) ThreadData {  // cache lines of its own, as it is written to all the time
    Tracer::Hits hits;             // of the rays that are traced together
    TraceCounters counters;
  };
  class Probe;

  void RecordObserved() const;
  void TraceAll(bool on_device, bool choosing);
  bool TraceWithProbe(bool probe_device);
  void TraceProbe(const Probe& probe, bool probe_device);
  void KeepOthersFromDevice(const Probe& probe);
  void TraceOnDevice();
  HitLists Prefilter(uint64_t rays);
  std::size_t WaitFor(std::size_t fan, HitLists* lists);
  void LoseDevice(const PrefilterError& error);
  template <typename At>
  void TraceRuns(const HitLists& lists, std::size_t count, At at);
  void TraceRun(const Tracer& tracer, const FanRun& run, const HitLists& lists,
                ThreadData* mine) const;
  void SumCounters();
  std::size_t CountRays(const FanRun& run) const;
  uint64_t CountRays(const Probe& probe) const;
  void LetDeviceGo();

  Scene& scene_;
  threads::WorkerPool* workers_ = nullptr;
  std::vector<ThreadData> thread_data_;
  FanOrder fan_order_;
  std::unique_ptr<sensing::Prefilter> prefilter_;
  PathChooser chooser_;
  Path path_ = Path::kFaster;
  bool device_in_use_ = false;  // the last batch was there
  struct Observed {
    const Model* finder = nullptr;
    uint32_t tag = 0, sample = 0;
    RayObserver* observer = nullptr;
  } observed_;
  TraceStatistics statistics_;
};

}  // namespace Stg::internal::sensing

#endif
