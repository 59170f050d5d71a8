// SPDX-License-Identifier: GPL-2.0-or-later
//
// Suggestions for options and settings that would make a run cheaper.

#include <algorithm>

#include "stage/estimate.hh"
#include "stage/format.hh"
#include "threads/processors.hh"

namespace Stg::program {

namespace {

double ValueOf(const std::vector<CostPart>& parts, const char* name) {
  for (const CostPart& part : parts)
    if (part.name == name) return part.value;
  return 0;
}

class HintFinder {
 public:
  explicit HintFinder(const Explanation& world) : w_(world), e_(world.estimate) {}

  std::vector<std::string> Give() {
    if (e_.step_ms < kNegligibleMs) {
      HintAtNothing();
      return std::move(hints_);
    }
    HintAtSensors();
    HintAtThreads();
    HintAtDevice();
    HintAtHeights();
    HintAtMemory();
    HintAtMoves();
    return std::move(hints_);
  }

 private:
  /// Below these limits, milliseconds and MB, a hint is not worthwhile.
  static constexpr double kNegligibleMs = 1, kNegligibleMb = 20;

  double Fraction(double ms) const { return e_.step_ms > 0 ? ms / e_.step_ms : 0; }
  std::string Ms(double ms) const { return Rounded(ms) + " ms"; }

  void HintAtNothing() {
    hints_.push_back("nothing: a step takes less than a millisecond, too little to parallelize");
  }

  void HintAtSensors() {
    const auto dearest = std::max_element(e_.kind_ms.begin(), e_.kind_ms.end());
    if (dearest == e_.kind_ms.end() || Fraction(*dearest) < 0.3) return;
    const SensorKind& kind = w_.scene.sensors[static_cast<size_t>(dearest - e_.kind_ms.begin())];
    const double now = static_cast<double>(w_.scene.step) / 1e3 / kind.updates_per_step;
    std::string which = kind.type + " sensors";
    if (kind.rays > 0) which += " of " + Count(static_cast<double>(kind.rays), "ray");
    hints_.push_back(
        Format("update_interval: the %s are %.0f %% of a step; at %s ms instead of %s "
               "it would be %s shorter",
               which.c_str(), 100 * Fraction(*dearest), Rounded(2 * now).c_str(),
               Rounded(now).c_str(), Ms(*dearest / 2).c_str()));
    if (kind.rays > 1 && kind.type == "ranger")
      hints_.push_back("samples: half of them in these sensors save nearly as much");
    if (kind.pixels > 0)
      hints_.push_back("resolution and range of the cameras: fewer pixels, fewer bodies to draw");
  }

  void HintAtThreads() {
    const double rays = ValueOf(e_.step, "rays");
    const unsigned cores = threads::CountUsableProcessors();
    if (w_.scene.threads > 1 || cores < 2 || Fraction(rays) < 0.3) return;
    hints_.push_back(Format("--threads %u: of %s for rays, it saves up to %s", cores,
                            Ms(rays).c_str(), Ms(rays * (1 - 1.0 / cores)).c_str()));
  }

  void HintAtDevice() {
    if (e_.rays < 1) return;
    if (!w_.scene.device.empty()) {
      HintAtMeasuredDevice();
      return;
    }
    constexpr double kTypicalBreakEven = 10000;  // rays per step, as in --help
    hints_.push_back(
        Format("--opencl: %s a step, likely %s break-even (some ten thousand); "
               "--explain --opencl measures it",
               Count(e_.rays, "ray").c_str(), e_.rays > kTypicalBreakEven ? "above" : "below"));
  }

  void HintAtMeasuredDevice() {
    const SensorCost* largest = nullptr;  // kinds are sorted by rays, so the first one counts
    for (const SensorCost& cost : w_.costs.sensors)
      if (!largest && cost.device_ray_ns >= 0 && cost.ray_ns > 0) largest = &cost;
    if (!largest) return;
    const bool pays = largest->device_ray_ns < largest->ray_ns;
    hints_.push_back(
        Format("--opencl: %s; a ray takes %.0f ns with the device and %.0f without, "
               "in samples of %.0f",
               pays ? "it pays" : "it does not pay", largest->device_ray_ns, largest->ray_ns,
               largest->rays * static_cast<double>(largest->sample)));
  }

  void HintAtHeights() {
    size_t used = 0;
    for (const SensedHeight& height : w_.scene.heights) used += height.sensors > 0;
    if (used <= w_.scene.layer_heights) return;
    hints_.push_back(
        Format("heights: rangers look at %zu, and %zu have a layer of their own; "
               "sensors at equal heights share one",
               used, w_.scene.layer_heights));
  }

  void HintAtMemory() {
    const double grid =
        ValueOf(e_.memory, "grid") + ValueOf(e_.memory, "bodies") + ValueOf(e_.memory, "layers");
    const double readings = ValueOf(e_.memory, "readings");
    if (grid > kNegligibleMb && grid > e_.peak_mb / 4)
      hints_.push_back(Format("resolution: cells of %s m instead of %s would save about %s MB",
                              Rounded(2 * w_.scene.resolution).c_str(),
                              Rounded(w_.scene.resolution).c_str(), Rounded(grid / 2).c_str()));
    if (readings > kNegligibleMb && readings > e_.peak_mb / 4)
      hints_.push_back(
          Format("samples: readings take %s MB, 24 bytes a ray", Rounded(readings).c_str()));
  }

  void HintAtMoves() {
    const double moves = ValueOf(e_.step, "move");
    if (Fraction(moves) < 0.3 || moves < kNegligibleMs) return;
    hints_.push_back(
        Format("resolution: %s of a step are for drawing robots that move, in "
               "proportion to their outlines in cells",
               Ms(moves).c_str()));
  }

  const Explanation& w_;
  const Estimate& e_;
  std::vector<std::string> hints_;
};

}  // namespace

std::vector<std::string> Hints(const Explanation& world) { return HintFinder(world).Give(); }

}  // namespace Stg::program
