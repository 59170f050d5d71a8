// SPDX-License-Identifier: GPL-2.0-or-later

#include <cmath>
#include <nlohmann/json.hpp>

#include "geometry/trigonometry.hh"
#include "messages/log.hh"
#include "stage/explain_ray.hh"
#include "stage/format.hh"

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;
using sensing::RayRecord;
using sensing::WalkStep;

double Degrees(double radians) { return radians * 180 / M_PI; }
double BearingOf(const RayRecord& r) {
  return ArcTangent(r.unit_vector.sine, r.unit_vector.cosine);
}
double HeadingOf(const RayRecord& r) {
  return ArcTangent(r.fan.heading.sine, r.fan.heading.cosine);
}

const char* AnswerName(RayRecord::Answer answer) {
  switch (answer) {
    case RayRecord::Answer::kOtherHeight:
      return "other height";
    case RayRecord::Answer::kMissed:
      return "missed";
    case RayRecord::Answer::kRejected:
      return "refused";
    case RayRecord::Answer::kAccepted:
      break;
  }
  return "accepted";
}

const char* AnswerText(RayRecord::Answer answer) {
  switch (answer) {
    case RayRecord::Answer::kOtherHeight:
      return "at another height: the ray continues";
    case RayRecord::Answer::kMissed:
      return "its edges are missed, or are behind the hit: the ray continues";
    case RayRecord::Answer::kRejected:
      return "rangers look through it, or it belongs to the robot: the ray continues";
    case RayRecord::Answer::kAccepted:
      break;
  }
  return "stops the ray";
}

/// Number of steps of each kind that the ray walk took up to the hit.
struct Leaps {
  size_t cells = 0, tiles = 0, regions = 0, superregions = 0;

  explicit Leaps(const RayRecord& record) {
    for (const RayRecord::Leg& leg : record.legs) {
      const double end = record.hit.range / record.fan.leg_length - leg.number;
      for (const WalkStep& step : leg.steps)
        if (step.from <= end) Add(step.kind);
    }
  }
  void Add(WalkStep::Kind kind) {
    cells += kind == WalkStep::Kind::kCell;
    tiles += kind == WalkStep::Kind::kTile;
    regions += kind == WalkStep::Kind::kRegion;
    superregions += kind == WalkStep::Kind::kSuper;
  }
};

std::string FanText(const ExplainedRay& e) {
  const RayRecord& r = e.ray.record;
  std::string text =
      Format("fan    %u rays from (%.4f, %.4f), %.3f m high; heading %.3f degrees, up to %g m\n",
             r.fan.record.samples, r.fan.x, r.fan.y, r.fan.z, Degrees(HeadingOf(r)), r.fan.range);
  text += Format("ray    sample %u: bearing %.3f degrees from there, %s model\n", e.sample,
                 Degrees(BearingOf(r)), r.fan.exact ? "exact" : "cell");
  if (r.fan.nothing)
    return text + "       no ray is cast: it has no length, or starts outside of the grid\n";
  text += Format("layer  %u of the grid: what rangers see at that height\n", r.fan.layer);
  text += r.mask_tiles == 0 ? std::string("mask   none\n")
                            : Format("mask   hides %u cells of the robot's own tree, in %u tiles\n",
                                     r.hidden_cells, r.mask_tiles);
  return text;
}

std::string WalkText(const ExplainedRay& e) {
  const RayRecord& r = e.ray.record;
  const Leaps leaps(r);
  std::string text = Format(
      "walk   %zu steps to a next cell, leaps over %zu tiles, %zu regions, %zu superregions\n",
      leaps.cells, leaps.tiles, leaps.regions, leaps.superregions);
  for (size_t i = 0; i < r.potential_hits.size(); i++) {
    const RayRecord::PotentialHit& cell = r.potential_hits[i];
    text += Format("  %zu. cell (%d, %d), %.4f m away\n", i + 1, cell.x, cell.y, cell.middle);
    for (size_t k = 0; k < cell.tests.size(); k++) {
      const RayRecord::BodyTest& test = cell.tests[k];
      text += "     " + Printable(e.ray.models[i][k]) +
              Format(", %g to %g m high: %s", test.z_min, test.z_max, AnswerText(test.answer));
      if (r.fan.exact && test.along > 0) text += Format(", %.6f m away", test.along);
      text += "\n";
    }
  }
  return text;
}

std::string RangeText(const ExplainedRay& e) {
  const RayRecord& r = e.ray.record;
  std::string text;
  if (e.ray.hit.empty())
    text = Format("hit    nothing: the sensor's greatest range, %.17g m\n", r.hit.range);
  else
    text = "hit    " + Printable(e.ray.hit) +
           Format(": %s, %.17g m\n",
                  r.fan.exact ? "the ray crosses its outline there"
                              : "the midpoint of the ray's path in the cell",
                  r.hit.range);
  const double noise = e.reading() - r.hit.range;
  const ModelRanger::Sensor& sensor = e.ranger->GetSensors()[e.sensor];
  const bool noisy = sensor.range_noise != 0 || sensor.range_noise_const != 0;
  text += noise == 0
              ? std::string("noise  none\n")
              : Format("noise  %+.17g m%s\n", noise,
                       noisy ? "" : ": not of the sensor; a controller changes its readings");
  return text + Format("range  %.17g m\n", e.reading());
}

}  // namespace

std::string RayText(const ExplainedRay& e) {
  return "sample " + std::to_string(e.sample) + " of sensor " + std::to_string(e.sensor) + " of " +
         Printable(e.ranger->TokenStr()) +
         Format(", cast at %g s\n\n", static_cast<double>(e.ray.time) / 1e6) + FanText(e) +
         (e.ray.record.fan.nothing ? "" : WalkText(e)) + RangeText(e);
}

std::string RayJson(const ExplainedRay& e) {
  const RayRecord& r = e.ray.record;
  const Leaps leaps(r);
  Json cells = Json::array();
  for (size_t i = 0; i < r.potential_hits.size(); i++) {
    Json bodies = Json::array();
    for (size_t k = 0; k < r.potential_hits[i].tests.size(); k++) {
      const RayRecord::BodyTest& test = r.potential_hits[i].tests[k];
      bodies.push_back({{"model", e.ray.models[i][k]},
                        {"z", {test.z_min, test.z_max}},
                        {"answer", AnswerName(test.answer)}});
      if (test.along > 0) bodies.back()["along"] = test.along;
    }
    const RayRecord::PotentialHit& cell = r.potential_hits[i];
    cells.push_back({{"cell", {cell.x, cell.y}}, {"middle", cell.middle}, {"bodies", bodies}});
  }
  const Json json = {{"program", "stage"},
                     {"version", Version()},
                     {"ranger", e.ranger->TokenStr()},
                     {"sensor", e.sensor},
                     {"sample", e.sample},
                     {"time", static_cast<double>(e.ray.time) / 1e6},
                     {"fan",
                      {{"rays", r.fan.record.samples},
                       {"start", {r.fan.x, r.fan.y, r.fan.z}},
                       {"heading", HeadingOf(r)},
                       {"range", std::isfinite(r.fan.range) ? Json(r.fan.range) : Json(nullptr)},
                       {"layer", r.fan.layer},
                       {"ray_model", r.fan.exact ? "exact" : "cell"}}},
                     {"bearing", BearingOf(r)},
                     {"mask", {{"tiles", r.mask_tiles}, {"cells", r.hidden_cells}}},
                     {"walk",
                      {{"cells", leaps.cells},
                       {"tiles", leaps.tiles},
                       {"regions", leaps.regions},
                       {"superregions", leaps.superregions}}},
                     {"potential_hits", cells},
                     {"hit", e.ray.hit.empty() ? Json(nullptr) : Json(e.ray.hit)},
                     {"hit_range", std::isfinite(r.hit.range) ? Json(r.hit.range) : Json(nullptr)},
                     {"range", std::isfinite(e.reading()) ? Json(e.reading()) : Json(nullptr)}};
  return json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

}  // namespace Stg::program
