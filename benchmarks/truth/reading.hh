// SPDX-License-Identifier: GPL-2.0-or-later
//
// One reading of a range sensor beside what an exact sensor would have read.

#ifndef STAGE_BENCHMARKS_TRUTH_READING_HH
#define STAGE_BENCHMARKS_TRUTH_READING_HH

#include <string>

#include "benchmarks/truth/scene.hh"

namespace truth {

enum class Verdict {
  kHit,          ///< both hit something, and the same thing as far as is known
  kNothing,      ///< neither hits anything
  kMissed,       ///< only the truth hits something
  kFalse,        ///< only the reading does
  kWrongObject,  ///< they hit different models
  kBetween       ///< worked out from two neighbouring beams: no hit counts as the maximum range
};

struct Reading {
  Stg::usec_t time = 0;  ///< at the end of the step
  Stg::usec_t age = 0;   ///< since the sensor looked
  const Stg::ModelRanger* ranger = nullptr;
  unsigned sensor = 0, sample = 0;
  Viewpoint from;
  double bearing = 0;
  double range = 0;  ///< the sensor's maximum
  double value = 0;  ///< what the sensor says
  bool between = false;
  Hit truth;
  Real clearance = 0;                ///< from the sensor to the nearest outline
  const Stg::Model* seen = nullptr;  ///< what the sensor saw, if that is known
  bool seen_is_known = false;

  Verdict verdict() const;
  /// |value - truth|; NaN where it makes no sense: unless interpolated, both have to be hits.
  double error() const;
};

const char* NameOf(Verdict verdict);
bool IsRobot(const Stg::Model& model);

/// The columns of a CSV file, and a reading's line; neither with an end of line.
std::string CsvHeader();
std::string CsvLine(const Reading& reading);

}  // namespace truth

#endif
