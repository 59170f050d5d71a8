// SPDX-License-Identifier: GPL-2.0-or-later

#include "benchmarks/truth/summary.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

namespace truth {

namespace {

// Bounds of bins: a value belongs to the bin with the greatest bound that does not exceed it.
constexpr double kRanges[] = {0, 0.5, 1, 2, 4, 8, 16};      // metres
constexpr double kIncidences[] = {0, 5, 15, 30, 60};        // degrees
constexpr double kStarts[] = {0, 1, 5};                     // cells
constexpr double kNearby = 2;                               // metres
constexpr double kThresholds[] = {0.001, 0.01, 0.05, 0.1};  // metres

std::string Plain(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

struct Place {
  int order;
  std::string name;
};

Place PlaceIn(std::span<const double> borders, double value, const std::string& unit) {
  size_t i = borders.size() - 1;
  while (i > 0 && value < borders[i]) i--;
  const std::string from = Plain(borders[i]);
  const bool last = i + 1 == borders.size();
  return {static_cast<int>(i),
          (last ? "from " + from : from + " to " + Plain(borders[i + 1])) + " " + unit};
}

}  // namespace

double Percentile(const std::vector<float>& sorted, double fraction) {
  if (sorted.empty()) return 0;
  const double rank = std::ceil(fraction * static_cast<double>(sorted.size()));
  return static_cast<double>(sorted[static_cast<size_t>(std::max(rank, 1.0)) - 1]);
}

void Tally::Add(const Reading& reading) {
  const Verdict verdict = reading.verdict();
  readings_++;
  true_hits_ += reading.truth.model != nullptr;
  missed_ += verdict == Verdict::kMissed;
  false_ += verdict == Verdict::kFalse;
  wrong_object_ += verdict == Verdict::kWrongObject;
  const double error = reading.error();
  if (std::isnan(error)) return;
  object_unknown_ += !reading.seen_is_known;
  errors_.push_back(static_cast<float>(error));
  signed_sum_ += static_cast<double>(Real{reading.value} - reading.truth.distance);
}

std::vector<std::pair<std::string, double>> Tally::Figures() {
  std::sort(errors_.begin(), errors_.end());
  const auto number = [](uint64_t n) { return static_cast<double>(n); };
  const double count = static_cast<double>(errors_.size());
  std::vector<std::pair<std::string, double>> figures = {
      {"readings", number(readings_)},
      {"true_hits", number(true_hits_)},
      {"missed", number(missed_)},
      {"false", number(false_)},
      {"wrong_object", number(wrong_object_)},
      {"object_unknown", number(object_unknown_)},
      {"errors", count},
      {"bias", count > 0 ? signed_sum_ / count : 0},
      {"p50", Percentile(errors_, 0.5)},
      {"p95", Percentile(errors_, 0.95)},
      {"p99", Percentile(errors_, 0.99)},
      {"max", errors_.empty() ? 0 : static_cast<double>(errors_.back())}};
  for (const double threshold : kThresholds) {
    const auto first =
        std::upper_bound(errors_.begin(), errors_.end(), static_cast<float>(threshold));
    figures.emplace_back("over_" + Plain(threshold),
                         count > 0 ? static_cast<double>(errors_.end() - first) / count : 0);
  }
  return figures;
}

void Summary::Count(Group group, int64_t place, const std::string& bin, const Reading& reading) {
  constexpr const char* kNames[] = {"all", "near", "range", "incidence", "object", "start", "age"};
  const auto [entry, is_new] = index_.try_emplace({group, place}, bins_.size());
  if (is_new) bins_.push_back({kNames[group], bin, Tally()});
  bins_[entry->second].tally.Add(reading);
}

void Summary::Add(const Reading& reading) {
  Count(kAll, 0, "all", reading);
  const Place start =
      PlaceIn(kStarts, static_cast<double>(reading.clearance) / cell_, "cells from the sensor");
  Count(kStart, start.order, start.name, reading);
  Count(kAge, static_cast<int64_t>(reading.age),
        Plain(static_cast<double>(reading.age) / 1e6) + " s", reading);
  if (!reading.truth.model) return;

  const double distance = static_cast<double>(reading.truth.distance);
  if (distance < kNearby) Count(kNear, 0, "up to 2 m", reading);
  const Place range = PlaceIn(kRanges, distance, "m");
  Count(kRange, range.order, range.name, reading);
  const Place incidence =
      PlaceIn(kIncidences, static_cast<double>(reading.truth.incidence) * 180 / M_PI, "degrees");
  Count(kIncidence, incidence.order, incidence.name, reading);
  const bool robot = IsRobot(*reading.truth.model);
  Count(kObject, robot, robot ? "robot" : "wall", reading);
}

std::vector<Summary::Bin>& Summary::bins() {
  std::vector<Bin> sorted;
  for (const auto& [key, place] : index_) sorted.push_back(std::move(bins_[place]));
  bins_ = std::move(sorted);
  size_t place = 0;
  for (auto& [key, at] : index_) at = place++;
  return bins_;
}

}  // namespace truth
