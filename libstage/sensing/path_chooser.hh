// SPDX-License-Identifier: GPL-2.0-or-later
//
// Device or host? For few rays a device costs more than it saves. Where the break-even lies depends
// on both and on the scene, so it is measured while the world runs. Both paths give the same
// results: the choice costs or saves time only. The same question is whether threads share a small
// step: then they stand for the device.

#ifndef STAGE_SENSING_PATH_CHOOSER_HH
#define STAGE_SENSING_PATH_CHOOSER_HH

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace Stg::internal::sensing {

/// Compares the two paths for batches of about the same size.
class PathComparison {
 public:
  /// Whether the next batch goes to the device.
  bool UseDevice();
  /// The present batch goes where it goes only to see what that takes.
  bool IsProbe() const { return is_probe_; }
  /// What the batch took on the path that was chosen for it.
  void Report(double seconds_per_ray);

 private:
  /// What rays cost on one of the paths.
  class Cost {
   public:
    /// The first `warm_ups` batches of a path are slower: they are not counted.
    explicit Cost(uint64_t warm_ups) : warm_ups_(warm_ups) {}

    bool known() const { return tries_ > warm_ups_; }
    /// Seconds for each ray: the (lower) median of the last few batches, for now and then one is
    /// interrupted by something else and takes many times as long.
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
  double TimesSlower() const;
  /// The last batch of the probe was so slow that there is nothing more to see.
  bool ProbeIsClear() const;
  uint64_t Wait() const;

  Cost device_{1}, host_{0};  // what both share is warm when the host's turn comes
  // The device gets the present batch, but not that before: it is sent what has changed since it
  // had its last one, which says little about its costs.
  bool catches_up_ = false;
  Cost catching_up_{1};
  bool compares_ = false;       // both are known
  bool device_faster_ = false;  // so it seems
  bool device_chosen_ = false;  // for the present batch
  bool is_probe_ = false;       // the present batch
  double last_cost_ = 0;        // of the batch before: seconds for each ray; 0 if not known
  uint64_t batches_ = 0;
  // A probe: a few batches on the path that seems to be the slower one.
  uint64_t probe_batches_ = 0;  // left of the probe that is going on
  uint64_t last_probe_ = 0;     // ended before the batch with this number
  uint64_t wait_ = 0;           // batches from then to the next one
  int early_probes_ = 0;        // left of those that come sooner than their costs would allow
  // Batches since when the path that is used seems to be the slower one.
  uint64_t seems_slower_ = 0;
};

class PathChooser {
 public:
  /// `always`: the device for every step.
  explicit PathChooser(bool always = false) : always_(always) {}

  /// Whether the next batch, of so many rays, goes to the device.
  bool UseDevice(uint64_t rays);
  /// The present batch goes where it goes only to see what that takes: a part of it would do.
  bool IsProbe() const { return !always_ && comparisons_[Size()].IsProbe(); }
  /// What the batch took on the path that was chosen for it, or a part of it of so many rays.
  void Report(double seconds) { Report(seconds, rays_); }
  void Report(double seconds, uint64_t rays);

 private:
  // Sizes are the same within a factor of two. Sensors that are read at different intervals make
  // batches of different sizes, in turn, and each size may be faster on another path.
  static constexpr size_t kSizes = 33;
  size_t Size() const { return std::min(static_cast<size_t>(std::bit_width(rays_)), kSizes - 1); }

  bool always_;
  uint64_t rays_ = 0;  // of the present batch
  std::array<PathComparison, kSizes> comparisons_;
};

}  // namespace Stg::internal::sensing

#endif
