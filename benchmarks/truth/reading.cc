// SPDX-License-Identifier: GPL-2.0-or-later

#include "benchmarks/truth/reading.hh"

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

namespace truth {

Verdict Reading::verdict() const {
  if (between) return Verdict::kBetween;
  const bool hit = value < range;
  if (!hit) return truth.model ? Verdict::kMissed : Verdict::kNothing;
  if (!truth.model) return Verdict::kFalse;
  return seen_is_known && seen != truth.model ? Verdict::kWrongObject : Verdict::kHit;
}

double Reading::error() const {
  const Verdict v = verdict();
  const bool comparable =
      v == Verdict::kHit || v == Verdict::kWrongObject || v == Verdict::kBetween;
  const double error = static_cast<double>(std::fabs(Real{value} - truth.distance));
  return comparable && std::isfinite(error) ? error : std::numeric_limits<double>::quiet_NaN();
}

const char* NameOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHit:
      return "hit";
    case Verdict::kNothing:
      return "nothing";
    case Verdict::kMissed:
      return "missed";
    case Verdict::kFalse:
      return "false";
    case Verdict::kWrongObject:
      return "wrong object";
    case Verdict::kBetween:
      return "between";
  }
  return "";
}

bool IsRobot(const Stg::Model& model) {
  return dynamic_cast<const Stg::ModelPosition*>(model.Root()) != nullptr;
}

std::string CsvHeader() {
  return "time_us,age_us,ranger,sensor,sample,x,y,z,heading,bearing,range_max,reading,truth,"
         "truth_model,truth_is_robot,seen_model,clearance,incidence_deg,verdict";
}

std::string CsvLine(const Reading& r) {
  char numbers[512];
  std::snprintf(numbers, sizeof numbers, "%u,%u,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,%.21Lg,",
                r.sensor, r.sample, static_cast<double>(r.from.origin.x),
                static_cast<double>(r.from.origin.y), r.from.z, static_cast<double>(r.from.heading),
                r.bearing, r.range, r.value, r.truth.distance);
  char rest[128];
  std::snprintf(rest, sizeof rest, ",%.9Lg,%.6Lg,", r.clearance,
                r.truth.incidence * 180 / std::numbers::pi_v<Real>);
  const std::string seen = !r.seen_is_known ? "?" : r.seen ? r.seen->TokenStr() : "";
  return std::to_string(r.time) + "," + std::to_string(r.age) + "," + r.ranger->TokenStr() + "," +
         numbers + (r.truth.model ? r.truth.model->TokenStr() : "") + "," +
         (r.truth.model && IsRobot(*r.truth.model) ? "1" : "0") + "," + seen + rest +
         NameOf(r.verdict());
}

}  // namespace truth
