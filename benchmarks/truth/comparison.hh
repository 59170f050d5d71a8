// SPDX-License-Identifier: GPL-2.0-or-later
//
// Compares the readings of a world's range sensors with the truth while the world runs.
//
// A sensor samples at the beginning of a step, before anything moves; its reading is available at
// the end of the step, when bodies have moved. So the truth is computed before each step.

#ifndef STAGE_BENCHMARKS_TRUTH_COMPARISON_HH
#define STAGE_BENCHMARKS_TRUTH_COMPARISON_HH

#include <functional>
#include <list>
#include <vector>

#include "benchmarks/truth/reading.hh"

namespace truth {

struct ComparisonOptions {
  enum class Mode {
    kFresh,   ///< readings of this step compared with the truth of this step
    kHeld,    ///< current readings of any age compared with the truth of this step
    kBetween  ///< new readings, interpolated between beams, compared with the truth there
  };
  Mode mode = Mode::kFresh;
  unsigned bearings = 0;  ///< kBetween: number of rays, evenly over the field of view
  bool once = false;      ///< only the first readings of each ranger
};

class Comparison {
 public:
  /// Subscribes to all rangers of the world, so that they also work without controllers. The world
  /// must outlive this object; models may be added but not deleted.
  Comparison(Stg::World* world, const ComparisonOptions& options,
             std::function<void(const Reading&)> report);

  /// Makes one step of the world, and reports on its readings if `compare` is set. Returns true if
  /// the world is done.
  bool Step(bool compare);

  /// Number of readings that were not compared because noise is added to them.
  uint64_t noisy_readings() const { return noisy_readings_; }
  /// True if a reading of every ranger has been compared.
  bool HasReportedAll() const;

 private:
  /// State of a sensor before the step.
  struct Before {
    Viewpoint from;
    double fov = 0, range = 0;
    unsigned count = 0;
    bool noisy = false;
    Real clearance = 0;
    std::vector<Stg::RaytraceResult> seen;
  };
  struct Watched {
    Stg::ModelRanger* ranger = nullptr;
    bool updated = false;       // updated in this step
    bool reported = false;      // updated at least once
    Stg::usec_t looked_at = 0;  // time of the last update
    std::vector<Before> sensors;
  };

  static int NoteUpdate(Stg::Model* model, void* watched);
  void TakeBefore(Watched* watched);
  void Report(const Watched& watched);
  void ReportBeams(const Reading& common, const Before& before,
                   const Stg::ModelRanger::Sensor& sensor);
  void ReportBetween(const Reading& common, const Before& before,
                     const Stg::ModelRanger::Sensor& sensor);
  bool Wanted(const Watched& watched) const;

  Stg::World* world_;
  ComparisonOptions options_;
  std::function<void(const Reading&)> report_;
  std::list<Watched> watched_;
  Scene scene_;
  uint64_t noisy_readings_ = 0;
};

}  // namespace truth

#endif
