// SPDX-License-Identifier: GPL-2.0-or-later
//
// Chooses between device and host. For few rays a device costs more than it saves. The break-even
// point depends on both and on the scene, so it is measured while the world runs. Results are the
// same, only the time differs. Also chooses whether a small step uses several threads ("device").

#ifndef STAGE_SENSING_PATH_CHOOSER_HH
#define STAGE_SENSING_PATH_CHOOSER_HH

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace Stg::internal::sensing {

/// Compares the two paths for batches of similar size.
class PathComparison {
 public:
  /// True if the next batch should go to the device.
  bool UseDevice();
  /// True if the current batch only measures the path that seems slower.
  bool IsProbe() const { return is_probe_; }
  /// Reports the time of the batch on the chosen path.
  void Report(double seconds_per_ray);

 private:
  /// Cost of rays on one of the paths.
  class Cost {
   public:
    /// The first `warm_ups` batches of a path are slower and not counted.
    explicit Cost(uint64_t warm_ups) : warm_ups_(warm_ups) {}

    bool known() const { return tries_ > warm_ups_; }
    /// Seconds per ray: the (lower) median of the last batches, because an interrupted batch may
    /// take many times as long.
    double typical() const { return typical_; }
    void Note(double seconds_per_ray);

   private:
    static constexpr uint64_t kKept = 5;
    double last_[kKept] = {};
    double typical_ = 0;
    uint64_t warm_ups_, tries_ = 0;
  };
  bool Choose();
  void BeginToCompare();
  void EndProbe();
  double CostRatio() const;
  /// True if the last batch of the probe was so slow that the probe can stop.
  bool ProbeIsClear() const;
  uint64_t Wait() const;

  Cost device_{1}, host_{0};  // the first batch on the host finds shared data warm
  // True if the device gets the current batch but did not get the previous one. It then receives
  // all changes since its last batch, so the time says little about its usual cost.
  bool catches_up_ = false;
  Cost catching_up_{1};
  bool both_known_ = false;     // both costs are known
  bool device_faster_ = false;  // estimate
  bool device_chosen_ = false;  // for the current batch
  bool is_probe_ = false;       // for the current batch
  double last_cost_ = 0;        // of the previous batch: seconds per ray; 0 if unknown
  uint64_t batches_ = 0;
  // A probe is a few batches on the path that seems slower.
  uint64_t probe_batches_ = 0;  // remaining batches of the current probe
  uint64_t last_probe_ = 0;     // number of the batch before which it ended
  uint64_t wait_ = 0;           // batches from then to the next probe
  int early_probes_ = 0;        // remaining early probes, which ignore the limit on costs
  // Number of consecutive batches for which the path in use has seemed slower.
  uint64_t seems_slower_ = 0;
};

class PathChooser {
 public:
  /// `always`: use the device for every step.
  explicit PathChooser(bool always = false) : always_(always) {}

  /// True if the next batch, of `rays` rays, should go to the device.
  bool UseDevice(uint64_t rays);
  /// True if the current batch only measures the path that seems slower; a part of it suffices.
  bool IsProbe() const { return !always_ && comparisons_[Size()].IsProbe(); }
  /// Reports the time of the batch, or of a part of it with `rays` rays, on the chosen path.
  void Report(double seconds) { Report(seconds, rays_); }
  void Report(double seconds, uint64_t rays);

 private:
  // One comparison per power of two. Sensors with different intervals make batches of different
  // sizes, and each size may be faster on another path.
  static constexpr size_t kSizes = 33;
  size_t Size() const { return std::min(static_cast<size_t>(std::bit_width(rays_)), kSizes - 1); }

  bool always_;
  uint64_t rays_ = 0;  // of the current batch
  std::array<PathComparison, kSizes> comparisons_;
};

}  // namespace Stg::internal::sensing

#endif
