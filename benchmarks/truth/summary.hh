// SPDX-License-Identifier: GPL-2.0-or-later
//
// Many readings in few figures: how many hits are lost or made up, and how large the errors are,
// for all readings and for groups of them.

#ifndef STAGE_BENCHMARKS_TRUTH_SUMMARY_HH
#define STAGE_BENCHMARKS_TRUTH_SUMMARY_HH

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/truth/reading.hh"

namespace truth {

/// The value that a share of the sorted values lies below or at: the smallest one of which at least
/// that share of all are not greater. 0 of none.
double Percentile(const std::vector<float>& sorted, double fraction);

class Tally {
 public:
  void Add(const Reading& reading);

  /// All figures by name, in a fixed order. Sorts the errors.
  std::vector<std::pair<std::string, double>> Figures();

 private:
  uint64_t readings_ = 0, true_hits_ = 0, missed_ = 0, false_ = 0, wrong_object_ = 0,
           object_unknown_ = 0;
  double signed_sum_ = 0;
  std::vector<float> errors_;  // seven digits of an error are plenty
};

/// A group is a way to sort readings into bins; a reading is in one bin of each group at most.
class Summary {
 public:
  /// `cell`: the width of the world's cells, by which nearness counts.
  explicit Summary(double cell) : cell_(cell) {}

  void Add(const Reading& reading);

  struct Bin {
    std::string group, bin;
    Tally tally;
  };
  /// Group by group, "all" first; only bins that have readings.
  std::vector<Bin>& bins();

 private:
  enum Group : int { kAll, kNear, kRange, kIncidence, kObject, kStart, kAge };
  void Count(Group group, int64_t place, const std::string& bin, const Reading& reading);

  double cell_;
  std::vector<Bin> bins_;
  std::map<std::pair<Group, int64_t>, size_t> index_;  // by group and the bin's place in it
};

}  // namespace truth

#endif
