// SPDX-License-Identifier: GPL-2.0-or-later
//
// Device or host? For few rays a device costs more than it saves. Where the break-even lies depends
// on both and on the scene, so it is measured while the world runs. Both paths give the same
// results: the choice costs or saves time only.

#ifndef STAGE_WORLD_PATH_CHOOSER_HH
#define STAGE_WORLD_PATH_CHOOSER_HH

#include <cstdint>

namespace Stg {

class PathChooser {
 public:
  /// `always`: the device for every step.
  explicit PathChooser(bool always = false) : always_(always) {}

  /// Whether the next batch, of so many rays, goes to the device.
  bool UseDevice(uint64_t rays);
  /// What the batch took on the path that was chosen for it.
  void Report(double seconds);

 private:
  // Seconds for each ray, smoothed; below 0: not known yet.
  struct Path {
    double cost = -1;
    uint64_t tries = 0;
  };
  bool always_;
  Path device_, host_;
  bool device_chosen_ = false;
  uint64_t rays_ = 0;
  uint64_t batches_ = 0;
  uint64_t next_look_ = 0;  // at the batch with this number the slower path is tried again
  uint64_t look_after_ = 32;
};

}  // namespace Stg

#endif
