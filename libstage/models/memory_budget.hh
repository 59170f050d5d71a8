// SPDX-License-Identifier: GPL-2.0-or-later
//
// How much memory a world file may ask for.

#ifndef STAGE_MODELS_MEMORY_BUDGET_HH
#define STAGE_MODELS_MEMORY_BUDGET_HH

#include <cstddef>
#include <limits>
#include <string>

namespace Stg {

class Worldfile;

/// Adds up what the numbers in a world file make of memory, such as the samples of sensors: with
/// macros, a short file may ask for more than any machine has. It is an estimate from below, and
/// the same on every machine. Outside of loading, each model is looked at by itself.
class MemoryBudget {
 public:
  static constexpr double kUsualMegabytes = 2000;
  /// Bytes for each of the things that files ask for by number.
  static constexpr double kCorner = 48, kPixel = 8, kSample = 24, kBumper = 120;

  /// Before a world is loaded.
  void Begin(double megabytes) {
    most_ = megabytes > 0 ? megabytes * 1e6 : std::numeric_limits<double>::infinity();
    taken_ = 0;
    adds_up_ = true;
  }
  /// The world is loaded.
  void End() { adds_up_ = false; }

  /// Throws LoadError, with the place of the property that asks for so many things of that many
  /// bytes each, if it is too much. To be called before the memory is taken.
  void Take(const Worldfile& wf, int entity, const char* property, std::size_t count,
            double bytes_each, const std::string& things);

 private:
  double most_ = kUsualMegabytes * 1e6, taken_ = 0;
  bool adds_up_ = false;
};

}  // namespace Stg

#endif
