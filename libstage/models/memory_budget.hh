// SPDX-License-Identifier: GPL-2.0-or-later
//
// Limits the memory that a world file may request.

#ifndef STAGE_MODELS_MEMORY_BUDGET_HH
#define STAGE_MODELS_MEMORY_BUDGET_HH

#include <cstddef>
#include <limits>
#include <string>

namespace Stg {

class Worldfile;

/// Sums a lower bound of the memory that numbers in a world file imply, such as those of samples:
/// with macros, a short file can request more than any machine has. Independent of the machine.
/// Outside of loading, each request is checked alone.
class MemoryBudget {
 public:
  static constexpr double kUsualMegabytes = 2000;
  /// Bytes per item that files request by number.
  static constexpr double kCorner = 48, kPixel = 8, kSample = 24, kBumper = 120, kFieldCell = 16;

  /// Call before a world is loaded.
  void Begin(double megabytes) {
    max_bytes_ = megabytes > 0 ? megabytes * 1e6 : std::numeric_limits<double>::infinity();
    used_bytes_ = 0;
    accumulates_ = true;
  }
  /// Call after the world is loaded.
  void End() { accumulates_ = false; }

  /// Call before allocating `count` items of `bytes_each` bytes. Throws LoadError at the place of
  /// the property if the total is too large.
  void Take(const Worldfile& wf, int entity, const char* property, std::size_t count,
            double bytes_each, const std::string& things);

 private:
  double max_bytes_ = kUsualMegabytes * 1e6, used_bytes_ = 0;
  bool accumulates_ = false;
};

}  // namespace Stg

#endif
