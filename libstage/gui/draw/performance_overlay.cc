// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/performance_overlay.hh"

#include <cmath>

#include "messages/report.hh"
#include "models/position.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg::draw {

namespace {

using messages::Format;

constexpr double kPeriod = 0.5;  // measuring period, s

/// Counts positions with subscribers, as --stats does.
size_t CountRobots(World& world) {
  size_t robots = 0;
  for (const Model* model : world.engine().moving)
    robots += dynamic_cast<const ModelPosition*>(model) != nullptr && model->HasSubscribers();
  return robots;
}

double Total(const PhaseSeconds& s) {
  return s.gather + s.prefilter + s.trace + s.move + s.callbacks + s.energy + s.fields;
}

double Ratio(double a, double b) { return b > 0 ? a / b : 0; }

}  // namespace

void PerformanceOverlay::Update(const World& world, double now) {
  if (!started_ || world.statistics().steps < before_.steps) {
    started_ = true;
    since_ = now;
    frames_ = 0;
    simulated_since_ = world.SimTimeNow();
    before_ = world.statistics();
    if (lines_.empty()) Measure(world, 0);
    return;
  }
  frames_++;
  if (now - since_ < kPeriod) return;
  Measure(world, now - since_);
  since_ = now;
  frames_ = 0;
  simulated_since_ = world.SimTimeNow();
  before_ = world.statistics();
}

/// Averages over the current period; over the whole run if no period has passed yet.
void PerformanceOverlay::Measure(const World& world, double seconds) {
  const RunStatistics& after = world.statistics();
  const RunStatistics before = seconds > 0 ? before_ : RunStatistics();
  const double simulated =
      static_cast<double>(world.SimTimeNow() - (seconds > 0 ? simulated_since_ : 0)) / 1e6;
  const PhaseSeconds &a = before.seconds, &b = after.seconds;
  const double busy = Total(b) - Total(a);
  const auto steps = static_cast<double>(after.steps - before.steps);
  const auto rays = static_cast<double>(after.trace.rays - before.trace.rays);
  const auto hits = static_cast<double>(after.trace.potential_hits - before.trace.potential_hits);
  const size_t robots = CountRobots(const_cast<World&>(world));
  if (seconds > 0) {
    frames_per_second_ = frames_ / seconds;
    speed_ = simulated / seconds;
  }
  const auto phase = [&](const char* name, double from, double to) {
    const double fraction = Ratio(to - from, busy);
    const auto bars = static_cast<size_t>(std::lround(fraction * 20));
    return Format("%s  %.3f ms  %2.0f %%  ", name, 1e3 * Ratio(to - from, steps), 100 * fraction) +
           std::string(bars, '|');
  };
  lines_.clear();
  lines_.push_back(Format("%zu robots, r_ACC %.0f", robots,
                          Ratio(static_cast<double>(robots) * simulated, busy)));
  if (seconds > 0)
    lines_.push_back(Format("%.1f x real time, %.1f frames/s", speed_, frames_per_second_));
  lines_.push_back(Format("rays: %.3g a second, %.2f potential hits each", Ratio(rays, busy),
                          Ratio(hits, rays)));
  if (after.device.empty())
    lines_.push_back(
        Format("device: none, %u thread%s", after.threads, after.threads == 1 ? "" : "s"));
  else
    lines_.push_back("device: " + after.device +
                     Format(", in %.0f of %.0f steps",
                            static_cast<double>(after.device_steps - before.device_steps), steps));
  lines_.push_back(Format("a step takes %.3f ms:", 1e3 * Ratio(busy, steps)));
  lines_.push_back(phase("gather", a.gather, b.gather));
  lines_.push_back(phase("prefilter", a.prefilter, b.prefilter));
  lines_.push_back(phase("trace", a.trace, b.trace));
  lines_.push_back(phase("move", a.move, b.move));
  lines_.push_back(phase("callbacks", a.callbacks, b.callbacks));
  lines_.push_back(phase("energy", a.energy, b.energy));
  if (b.fields > 0) lines_.push_back(phase("fields", a.fields, b.fields));
}

}  // namespace Stg::draw
