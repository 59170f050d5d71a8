// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds runs of things that can be done on several threads at once, among others.

#ifndef STAGE_WORLD_RUN_FINDER_HH
#define STAGE_WORLD_RUN_FINDER_HH

#include <cstddef>

namespace Stg {

/// Asked for each thing of a list in turn whether a run begins there. It looks at each thing once,
/// although those of a run that is too short, or turns out not to be one, are asked for again.
class RunFinder {
 public:
  /// Fewer things than that make no run.
  void SetFewest(size_t fewest) { fewest_ = fewest; }

  /// `find_length()` looks how many things from here on make a run, of `count` that there are.
  /// Returns that, or 0 if they are to be done one after the other.
  template <typename F>
  size_t Find(size_t count, F find_length) {
    if (to_skip_ > 0) {
      to_skip_--;
      return 0;
    }
    if (count < fewest_) return 0;
    const size_t length = find_length();
    if (length > 0 && length >= fewest_) return length;
    Skip(length);
    return 0;
  }

  /// This thing and those behind it, `length` in all, are to be done one after the other.
  void Skip(size_t length) { to_skip_ = length > 0 ? length - 1 : 0; }
  /// At the beginning of a list.
  void Begin() { to_skip_ = 0; }

 private:
  size_t fewest_ = 16;
  size_t to_skip_ = 0;
};

}  // namespace Stg

#endif
