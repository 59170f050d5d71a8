// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/batch_tracer.hh"

#include <algorithm>
#include <span>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "threads/wall_clock.hh"

namespace Stg::internal::sensing {

using threads::WallClock;

/// Every n-th interval of fans, traced on the path that seems slower to measure it there. The
/// others take the usual path, because probing the whole batch would be expensive.
class BatchTracer::Probe {
 public:
  /// Selects one interval in `of`, which is at least 2.
  Probe(const std::vector<FanInterval>& intervals, std::size_t of)
      : intervals_(intervals), of_(of) {
    STAGE_ASSERT(of >= 2);
  }

  std::size_t count() const { return (intervals_.size() + of_ - 1) / of_; }
  const FanInterval& operator[](std::size_t i) const {
    STAGE_ASSERT(i < count());
    return intervals_[i * of_];
  }
  std::size_t other_count() const { return intervals_.size() - count(); }
  const FanInterval& Other(std::size_t i) const {
    STAGE_ASSERT(i < other_count());
    return intervals_[i + i / (of_ - 1) + 1];
  }

 private:
  const std::vector<FanInterval>& intervals_;
  std::size_t of_;
};

void BatchTracer::SetWorkers(threads::WorkerPool* workers) {
  STAGE_ASSERT(workers && workers->threads() >= 1);
  thread_data_.resize(std::max<std::size_t>(thread_data_.size(), workers->threads()));
  workers_ = workers;
}

BatchTracer::~BatchTracer() { ReleaseDevice(); }

void BatchTracer::ReleaseDevice() {
  if (prefilter_ && prefilter_->IsForked()) static_cast<void>(prefilter_.release());
  prefilter_ = nullptr;
}

void BatchTracer::SetPrefilter(std::unique_ptr<sensing::Prefilter> prefilter, bool always) {
  ReleaseDevice();
  prefilter_ = std::move(prefilter);
  chooser_ = PathChooser(always);
  scene_.grid.TrackChanges(prefilter_ != nullptr);
  statistics_.device = prefilter_ ? prefilter_->DeviceName() : "";
  if (prefilter_) statistics_.prefilter = prefilter_->statistics();  // it may never get a batch
}

void BatchTracer::SharePrefilterOf(const BatchTracer& other, bool always) {
  if (other.prefilter_) SetPrefilter(other.prefilter_->CloneForWorld(), always);
}

bool BatchTracer::KeepPrefilter(bool always) {
  if (!prefilter_) return false;
  chooser_ = PathChooser(always);
  statistics_.device = prefilter_->DeviceName();
  return true;
}

void BatchTracer::Trace() {
  STAGE_ASSERT(workers_);
  RayBatch& batch = scene_.batch;
  batch.Close(scene_.tables);
  if (observed_.observer) RecordObserved();
  const bool can = prefilter_ && batch.FitsDevice();
  const bool choosing = can && path_ == Path::kFaster;
  const bool on_device =
      can && (choosing ? chooser_.UseDevice(batch.ray_count()) : path_ == Path::kDevice);
  if (!(choosing && chooser_.IsProbe() && TraceWithProbe(on_device))) TraceAll(on_device, choosing);
  Drop();
}

void BatchTracer::RecordObserved() const {
  const RayBatch& batch = scene_.batch;
  const Tracer tracer(scene_.grid);
  for (const Fan& fan : batch.fans()) {
    const bool is_alone = fan.tag == observed_.alone;
    if (fan.finder != observed_.finder || !(is_alone || fan.tag == observed_.tag)) continue;
    const uint32_t index = is_alone ? 0 : observed_.sample;
    if (index >= fan.record.samples) continue;
    RayRecord record;
    record.sample = observed_.sample;
    tracer.Record(fan, {batch.DirectionsOf(fan)[index], batch.UnitVectorsOf(fan)[index]},
                  batch.SelfMaskOf(fan), &record);
    observed_.observer->ReceiveRecord(record);
  }
}

void BatchTracer::Drop() noexcept {
  scene_.batch.Clear();
  scene_.batch_number++;
}

/// `choosing`: report the time to the path chooser.
void BatchTracer::TraceAll(bool on_device, bool choosing) {
  device_in_use_ = on_device;
  const double start = WallClock();
  if (on_device) {
    TraceOnDevice();
  } else {
    workers_->AllowSpinning(true);
    const std::vector<FanInterval>& intervals = fan_order_.Of(scene_.batch);
    TraceIntervals(HitLists(), intervals.size(), [&](std::size_t i) { return intervals[i]; });
    statistics_.trace_seconds += WallClock() - start;
  }
  if (choosing) chooser_.Report(WallClock() - start);
}

/// Traces in the order of the batch, in which hit lists arrive. With hit lists the host hardly
/// reads the grid, so other orders gain nothing. The host traces what the device does not.
void BatchTracer::TraceOnDevice() {
  const double start = WallClock();
  HitLists lists = Prefilter(scene_.batch.ray_count());
  double waited = WallClock() - start;
  const std::vector<FanInterval>& intervals = fan_order_.InBatch(scene_.batch);
  for (std::size_t done = 0; done < intervals.size();) {
    const double before = WallClock();
    const std::size_t fans_there =
        WaitFor(intervals[done].first + intervals[done].count - 1, &lists);
    waited += WallClock() - before;
    const std::size_t first = done;
    while (done < intervals.size() && intervals[done].first + intervals[done].count <= fans_there)
      done++;
    STAGE_ASSERT(done > first);
    TraceIntervals(lists, done - first, [&](std::size_t i) { return intervals[first + i]; });
  }
  statistics_.prefilter_seconds += waited;
  statistics_.trace_seconds += WallClock() - start - waited;
}

/// Waits for the hit lists of this fan. Returns the number of fans whose lists have arrived. That
/// is all of them if there are no lists, or if the device has just failed.
std::size_t BatchTracer::WaitFor(std::size_t fan, HitLists* lists) {
  if (lists->per_ray == 0) return scene_.batch.fans().size();
  try {
    const std::size_t fans = prefilter_->WaitFor(scene_.batch, fan);
    STAGE_ASSERT(fans > fan && fans <= scene_.batch.fans().size());
    statistics_.prefilter = prefilter_->statistics();
    return fans;
  } catch (const PrefilterError& error) {
    LoseDevice(error);
    *lists = HitLists();
    return scene_.batch.fans().size();
  }
}

/// Traces the batch with a part of it as a probe. Returns false, without tracing, if there are too
/// few fans or if the time of a part would not tell the time of the whole.
bool BatchTracer::TraceWithProbe(bool probe_device) {
  // On a device with its own processors, few rays take about as long as many.
  if (probe_device != prefilter_->UsesHost()) return false;
  constexpr std::size_t kSlicesPerThread = 8, kMaxSlices = 8;
  const std::vector<FanInterval>& intervals = fan_order_.Of(scene_.batch);
  const std::size_t of =
      std::min(kMaxSlices, intervals.size() / (kSlicesPerThread * workers_->threads()));
  if (of < 2) return false;
  const Probe probe(intervals, of);
  if (CountRays(probe) == 0) return false;
  if (probe_device) ExcludeOthersFromDevice(probe);
  TraceProbe(probe, probe_device);
  return true;
}

void BatchTracer::ExcludeOthersFromDevice(const Probe& probe) {
  for (std::size_t i = 0; i < probe.other_count(); i++) {
    const FanInterval& interval = probe.Other(i);
    for (uint32_t k = 0; k < interval.count; k++)
      scene_.batch.ExcludeFromDevice(interval.first + k);
  }
}

void BatchTracer::TraceProbe(const Probe& probe, bool probe_device) {
  const uint64_t rays = CountRays(probe), all = scene_.batch.ray_count();
  const double sent_before = statistics_.prefilter.send_seconds;
  const double start = WallClock();
  HitLists lists = Prefilter(probe_device ? rays : all);
  WaitFor(scene_.batch.fans().size() - 1, &lists);
  const HitLists none;
  const double walked = WallClock();
  TraceIntervals(probe_device ? lists : none, probe.count(),
                 [&](std::size_t i) { return probe[i]; });
  const double probed = WallClock();
  TraceIntervals(probe_device ? none : lists, probe.other_count(),
                 [&](std::size_t i) { return probe.Other(i); });
  statistics_.prefilter_seconds += walked - start;
  statistics_.trace_seconds += WallClock() - walked;
  if (!prefilter_) return;  // it has just been lost
  if (!probe_device) return chooser_.Report(probed - walked, rays);
  // The time to send the grid does not depend on the number of rays.
  const double send = statistics_.prefilter.send_seconds - sent_before;
  const double parts = static_cast<double>(all) / static_cast<double>(rays);
  chooser_.Report(send + (probed - start - send) * parts);
}

/// Asks the device for ranges where it can find them.
void BatchTracer::AskForRanges() {
  const RangeModels models = prefilter_->ranges();
  if (!find_ranger_view_ || !(models.cell || models.exact)) return;
  const RangerView view = find_ranger_view_();
  if (!view.is_uniform) return;
  ranger_return_ = view.ranger_return;
  scene_.batch.AskForRanges(models, scene_.grid);
}

/// `rays` is the number of rays in fans that the device may walk.
HitLists BatchTracer::Prefilter(uint64_t rays) {
  // On a device that is the host's CPU, spinning threads would compete with it. Applies until the
  // next batch, because SendAhead() uses the device too.
  workers_->AllowSpinning(!prefilter_->UsesHost());
  try {
    STAGE_ASSERT(scene_.batch.FitsDevice() && rays <= scene_.batch.ray_count());
    AskForRanges();
    const HitLists lists = prefilter_->Walk(scene_.grid, scene_.tables, scene_.batch, workers_);
    statistics_.device_steps++;
    statistics_.device_rays += rays;
    statistics_.prefilter = prefilter_->statistics();
    return lists;
  } catch (const PrefilterError& error) {
    LoseDevice(error);
    return HitLists();
  }
}

void BatchTracer::SendAhead() {
  if (!prefilter_ || !device_in_use_) return;
  try {
    prefilter_->SendAhead(scene_.grid);
  } catch (const PrefilterError& error) {
    LoseDevice(error);
  }
}

void BatchTracer::LoseDevice(const PrefilterError& error) {
  messages::Warn(messages::Shortened(prefilter_->DeviceName()) + " failed (" +
                 messages::Shortened(error.what(), messages::kMaxDetailBytes) +
                 "); continuing without it");
  SetPrefilter(nullptr, false);
}

/// Traces the fans of at(0) .. at(count - 1).
template <typename At>
void BatchTracer::TraceIntervals(const HitLists& lists, std::size_t count, At at) {
  // Waking threads takes as long as tracing a few hundred rays.
  constexpr uint32_t kTooFewRays = 500;
  const std::size_t grain =
      scene_.batch.ray_count() < kTooFewRays ? count : workers_->Grain(count, 32);
  const Tracer tracer(scene_.grid);
  workers_->Run(count, grain, [&](std::size_t begin, std::size_t end, unsigned thread) {
    STAGE_ASSERT(begin < end && end <= count && thread < thread_data_.size());
    for (std::size_t i = begin; i < end; i++)
      TraceInterval(tracer, at(i), lists, &thread_data_[thread]);
  });
  SumCounters();
}

void BatchTracer::SumCounters() {
  for (ThreadData& data : thread_data_) {
    statistics_.trace.rays += data.counters.rays;
    statistics_.trace.potential_hits += data.counters.potential_hits;
    statistics_.trace.resumed += data.counters.resumed;
    statistics_.trace.ranges_given += data.counters.ranges_given;
    data.counters = TraceCounters();
  }
}

void BatchTracer::TraceInterval(const Tracer& tracer, const FanInterval& interval,
                                const HitLists& lists, ThreadData* mine) const {
  STAGE_ASSERT(interval.count > 0 && interval.first + interval.count <= scene_.batch.fans().size());
  const std::span<const Fan> fans = scene_.batch.fans().subspan(interval.first, interval.count);
  STAGE_ASSERT(std::ranges::all_of(fans, [](const Fan& fan) { return fan.sink != nullptr; }));
  for (const Fan& fan : fans) fan.sink->PrefetchHits(fan.tag);
  const auto has_ranges = [&](std::size_t i) {
    const DeviceFan& fan = scene_.batch.device_fans()[interval.first + i];
    return lists.per_ray > 0 && fan.fits && scene_.batch.ResultOf(fan) != DeviceResult::kHits;
  };
  for (std::size_t i = 0; i < fans.size();) {
    const std::size_t first = i;
    if (has_ranges(i)) {
      PassRanges(tracer, fans[i++], lists, mine);
      continue;
    }
    do i++;
    while (i < fans.size() && !has_ranges(i));
    TraceFans(tracer, fans.subspan(first, i - first), lists, mine);
  }
}

/// Traces fans of one interval and passes their hits on.
void BatchTracer::TraceFans(const Tracer& tracer, std::span<const Fan> fans, const HitLists& lists,
                            ThreadData* mine) const {
  tracer.TraceFans(scene_.batch, fans, lists, &mine->hits, &mine->counters);
  mine->hits.ForEachFan(
      fans, [](const Fan& fan, const RayHits& hits) { fan.sink->ReceiveHits(fan.tag, hits); });
}

/// Passes on ranges that the device has found.
void BatchTracer::PassRanges(const Tracer& tracer, const Fan& fan, const HitLists& lists,
                             ThreadData* mine) const {
  const FanRecord& record = fan.record;
  STAGE_ASSERT(lists.per_ray == 1);
  const DeviceRanges ranges{lists.RangesOf(record.first_ray), record.samples, ranger_return_};
  if (!fan.sink->ReceiveRanges(fan.tag, ranges))
    return TraceFans(tracer, std::span(&fan, 1), HitLists(), mine);
  mine->counters.rays += record.samples;
  mine->counters.ranges_given += record.samples;
}

std::size_t BatchTracer::CountRays(const FanInterval& interval) const {
  std::size_t rays = 0;
  for (const Fan& fan : scene_.batch.fans().subspan(interval.first, interval.count))
    rays += fan.record.samples;
  return rays;
}

uint64_t BatchTracer::CountRays(const Probe& probe) const {
  uint64_t rays = 0;
  for (std::size_t i = 0; i < probe.count(); i++) rays += CountRays(probe[i]);
  return rays;
}

}  // namespace Stg::internal::sensing
