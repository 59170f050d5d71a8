// SPDX-License-Identifier: GPL-2.0-or-later
//
// Distributions of the scores of a candidate's samples.

#include "whatif/outcome.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "whatif/consequence_engine.hh"

namespace Stg {

double Outcome::Worst() const {
  return scores.empty() ? std::numeric_limits<double>::quiet_NaN() : std::ranges::min(scores);
}

double Outcome::Quantile(double q) const {
  if (scores.empty() || !(q >= 0 && q <= 1)) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> sorted = scores;
  std::ranges::sort(sorted);
  const double place = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(place);
  if (below + 1 == sorted.size()) return sorted.back();
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[below + 1] - sorted[below]);
}

double Outcome::Deviation() const {
  if (scores.size() < 2) return 0;
  double sum = 0;
  for (const double each : scores) sum += (each - score) * (each - score);
  return std::sqrt(sum / static_cast<double>(scores.size() - 1));
}

double Outcome::CollisionRisk() const {
  if (collided.empty()) return 0;
  return static_cast<double>(std::ranges::count(collided, 1)) /
         static_cast<double>(collided.size());
}

Interval Outcome::CollisionInterval(double errors) const {
  if (collided.empty()) return {0, 1};
  const auto count = static_cast<double>(collided.size());
  const double share = CollisionRisk(), square = errors * errors / count;
  const double middle = (share + square / 2) / (1 + square);
  const double half =
      errors / (1 + square) *
      std::sqrt(share * (1 - share) / count + errors * errors / (4 * count * count));
  return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

double Preference::ValueOf(const Outcome& outcome) const {
  switch (kind) {
    case kMean:
      return outcome.score;
    case kWorst:
      return outcome.Worst();
    case kQuantile:
      return outcome.Quantile(quantile);
  }
  return outcome.score;
}

namespace whatif {

namespace {

/// How many standard errors of n samples are as unlikely as `errors` of a normal distribution: the
/// first terms of Student's quantile (Abramowitz and Stegun: Handbook of Mathematical Functions,
/// 26.7.5).
double StudentErrors(double errors, size_t samples) {
  const double freedom = static_cast<double>(samples - 1), z = errors, square = z * z;
  return z + z * (square + 1) / (4 * freedom) +
         z * ((5 * square + 16) * square + 3) / (96 * freedom * freedom);
}

/// Least mean difference of the scores of samples with equal numbers that is believable.
double LeastDifference(const Outcome& one, const Outcome& other, double errors) {
  const size_t count = std::min(one.scores.size(), other.scores.size());
  if (count < 2) return -std::numeric_limits<double>::infinity();
  double mean = 0, sum = 0;
  for (size_t i = 0; i < count; i++)
    mean += (one.scores[i] - other.scores[i]) / static_cast<double>(count);
  for (size_t i = 0; i < count; i++) {
    const double error = one.scores[i] - other.scores[i] - mean;
    sum += error * error;
  }
  const double variance = sum / static_cast<double>(count - 1) / static_cast<double>(count);
  return mean - StudentErrors(errors, count) * std::sqrt(variance);
}

/// The order statistics between which a quantile is, by the normal approximation of the binomial
/// distribution; infinite where there are too few samples.
Interval QuantileInterval(const Outcome& outcome, double q, double errors) {
  std::vector<double> sorted = outcome.scores;
  std::ranges::sort(sorted);
  const auto count = static_cast<double>(sorted.size());
  const double half = errors * std::sqrt(count * q * (1 - q)) + 0.5;
  const double low = std::floor(count * q - half), high = std::ceil(count * q + half);
  const double any = std::numeric_limits<double>::infinity();
  return {low < 0 ? -any : sorted[static_cast<size_t>(low)],
          high >= count ? any : sorted[static_cast<size_t>(high)]};
}

}  // namespace

bool IsToldApart(const Outcome& best, const Outcome& other, const Preference& preference,
                 double errors, double margin) {
  switch (preference.kind) {
    case Preference::kMean:
      return LeastDifference(best, other, errors) >= margin;
    case Preference::kQuantile:
      return QuantileInterval(best, preference.quantile, errors).low -
                 QuantileInterval(other, preference.quantile, errors).high >=
             margin;
    case Preference::kWorst:
      return false;
  }
  return false;
}

}  // namespace whatif

}  // namespace Stg
