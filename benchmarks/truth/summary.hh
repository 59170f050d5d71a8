// SPDX-License-Identifier: GPL-2.0-or-later
//
// Summarizes many readings: the fractions of missed and false hits, and the size of errors, for all
// readings and for groups.

#ifndef STAGE_BENCHMARKS_TRUTH_SUMMARY_HH
#define STAGE_BENCHMARKS_TRUTH_SUMMARY_HH

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/truth/reading.hh"

namespace truth {

/// The quantile of the sorted values: the smallest value such that at least this fraction of all
/// values do not exceed it; 0 if there are none.
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
  std::vector<float> errors_;  // seven digits of an error suffice
};

/// A group sorts readings into bins; a reading is in at most one bin of each group.
class Summary {
 public:
  /// `cell` is the width of the world's cells, in which distances are measured.
  explicit Summary(double cell) : cell_(cell) {}

  void Add(const Reading& reading);

  struct Bin {
    std::string group, bin;
    Tally tally;
  };
  /// The bins that have readings, group by group, "all" first.
  std::vector<Bin>& bins();

 private:
  enum Group : int { kAll, kNear, kRange, kIncidence, kObject, kStart, kAge };
  void Count(Group group, int64_t place, const std::string& bin, const Reading& reading);

  double cell_;
  std::vector<Bin> bins_;
  std::map<std::pair<Group, int64_t>, size_t> index_;  // by group and index of the bin
};

}  // namespace truth

#endif
