// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs along with a world and compares what its range sensors read with the truth.
//
// A sensor looks at the beginning of a step, before anything moves; its reading is there at the end
// of the step, when bodies are elsewhere. So the truth is taken before each step.

#ifndef STAGE_BENCHMARKS_TRUTH_COMPARISON_HH
#define STAGE_BENCHMARKS_TRUTH_COMPARISON_HH

#include <functional>
#include <list>
#include <vector>

#include "benchmarks/truth/reading.hh"

namespace truth {

struct ComparisonOptions {
  enum class Mode {
    kFresh,   ///< readings of this step against the truth of this step
    kHeld,    ///< whatever the sensor holds, old or new, against the truth of this step
    kBetween  ///< fresh ones, interpolated between beams, against the truth between the beams
  };
  Mode mode = Mode::kFresh;
  unsigned bearings = 0;  ///< kBetween: so many, evenly over the field of view
  bool once = false;      ///< only the first readings of each ranger
};

class Comparison {
 public:
  /// Subscribes to all rangers of the world, so that they work without controllers too. The world
  /// must outlive this; models may be added meanwhile, but not deleted.
  Comparison(Stg::World* world, const ComparisonOptions& options,
             std::function<void(const Reading&)> report);

  /// One step of the world. `compare`: whether to report on its readings. True: the world is done.
  bool Step(bool compare);

  /// Readings that were not compared, because noise is added to them.
  uint64_t noisy_readings() const { return noisy_readings_; }
  /// Every ranger has had a reading compared.
  bool HasReportedAll() const;

 private:
  /// A sensor before the step.
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
    bool updated = false;       // in this step
    bool reported = false;      // at least once
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
