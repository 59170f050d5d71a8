// SPDX-License-Identifier: GPL-2.0-or-later
//
// A reading of a range sensor, and the reading that an exact sensor would have.

#ifndef STAGE_BENCHMARKS_TRUTH_READING_HH
#define STAGE_BENCHMARKS_TRUTH_READING_HH

#include <string>

#include "benchmarks/truth/scene.hh"

namespace truth {

enum class Verdict {
  kHit,          ///< both hit something; the same model as far as known
  kNothing,      ///< neither hits anything
  kMissed,       ///< only the truth hits something
  kFalse,        ///< only the reading hits something
  kWrongObject,  ///< they hit different models
  kBetween       ///< interpolated between two beams; no hit counts as the maximum range
};

struct Reading {
  Stg::usec_t time = 0;  ///< at the end of the step
  Stg::usec_t age = 0;   ///< since the sensor sampled
  const Stg::ModelRanger* ranger = nullptr;
  unsigned sensor = 0, sample = 0;
  Viewpoint from;
  double bearing = 0;
  double range = 0;  ///< the sensor's maximum
  double value = 0;  ///< reading of the sensor
  bool between = false;
  Hit truth;
  Real clearance = 0;                ///< from the sensor to the nearest outline
  const Stg::Model* seen = nullptr;  ///< model that the sensor hit, if known
  bool seen_is_known = false;

  Verdict verdict() const;
  /// |value - truth|; NaN unless both are hits or the reading is interpolated.
  double error() const;
};

const char* NameOf(Verdict verdict);
bool IsRobot(const Stg::Model& model);

/// The columns of a CSV file, and the line of a reading; both without end of line.
std::string CsvHeader();
std::string CsvLine(const Reading& reading);

}  // namespace truth

#endif
