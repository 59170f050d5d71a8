// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/progress.hh"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "stage/interrupt.hh"

namespace Stg::program {

namespace {

constexpr double kPeriod = 0.25;    // seconds between updates
constexpr size_t kMaxSamples = 20;  // averages the speed over the last five seconds

/// Worlds advance in lock-step, so the one with the most steps left finishes last.
double StepsLeft(const World* world) {
  const usec_t end = world->GetQuitTime(), now = world->SimTimeNow();
  return end > now ? static_cast<double>(end - now) / static_cast<double>(world->sim_interval) : 0;
}

double Seconds(usec_t time) { return static_cast<double>(time) / 1e6; }

}  // namespace

Progress::Progress(std::optional<bool> wanted, const std::vector<LoadedWorld>& worlds)
    : next_(WallClock() + kPeriod) {
  bool end_known = true, clock = false;
  World* last = nullptr;
  for (const LoadedWorld& loaded : worlds) {
    World* world = loaded.world;
    end_known &= world->GetQuitTime() > 0;
    clock |= world->ShowsClock();
    const bool later = !last || (last->GetQuitTime() > 0 &&
                                 (world->GetQuitTime() == 0 || StepsLeft(world) > StepsLeft(last)));
    if (later) last = world;
  }
  if (!last || !wanted.value_or(isatty(STDERR_FILENO) != 0 && end_known && !clock)) return;
  last_ = last;
  samples_.push_back({WallClock(), Seconds(last->SimTimeNow())});
}

void Progress::Tick() {
  if (!last_) return;
  const double now = WallClock();
  if (now < next_) return;
  next_ = now + kPeriod;
  line_.Print(Text(now));
}

std::string Progress::Text(double now) {
  const double simulated = Seconds(last_->SimTimeNow()), end = Seconds(last_->GetQuitTime());
  samples_.push_back({now, simulated});
  if (samples_.size() > kMaxSamples) samples_.pop_front();
  const Sample& first = samples_.front();
  const double speed = now > first.wall ? (simulated - first.simulated) / (now - first.wall) : 0;

  char text[160];
  int length;
  if (end > 0)
    length = std::snprintf(text, sizeof text, " %2.0f%% of %.6g s simulated",
                           std::min(99.0, 100 * simulated / end), end);
  else
    length = std::snprintf(text, sizeof text, " %.1f s simulated", simulated);
  if (speed > 0)
    length += std::snprintf(text + length, sizeof text - static_cast<size_t>(length),
                            ", %.*f x real time", speed < 100 ? 1 : 0, speed);
  std::string line(text, static_cast<size_t>(length));
  if (speed > 0 && end > 0)
    line += ", " + DurationText(std::max(0.0, end - simulated) / speed) + " left";
  return line;
}

}  // namespace Stg::program
