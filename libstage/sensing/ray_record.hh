// SPDX-License-Identifier: GPL-2.0-or-later
//
// Explains a ray's range: the fan, the walk, the bodies that were tested and the result of each
// test. The tracer itself writes it, for pictures and for diagnosis.

#ifndef STAGE_SENSING_RAY_RECORD_HH
#define STAGE_SENSING_RAY_RECORD_HH

#include <cstdint>
#include <vector>

#include "sensing/fan.hh"
#include "sensing/ray_hit.hh"
#include "sensing/walk_record.hh"

namespace Stg::internal::sensing {

struct RayRecord {
  /// Result for a body in a visited cell.
  enum class Answer : uint8_t {
    kOtherHeight,  ///< the ray passes above or below it
    kMissed,       ///< exact model: the ray meets no edge of it, or only behind the nearest hit
    kRejected,     ///< the predicate lets the ray pass
    kAccepted      ///< the predicate accepts it as a hit
  };
  struct BodyTest {
    const Model* model;
    double z_min, z_max;  ///< height interval of the body, global, metres
    Answer answer;
    double along;  ///< exact model, if the predicate was called: metres to the crossing
  };
  /// An occupied cell on the ray's way.
  struct PotentialHit {
    int32_t x, y;
    double middle;  ///< metres from the start to the midpoint of the ray's path in the cell
    /// In order of stamps. Empty if the cell belongs to the other kind of rasterization only.
    std::vector<BodyTest> tests;
  };
  struct Leg {
    double number;  ///< from 0
    std::vector<WalkStep> steps;
  };

  Fan fan;
  uint32_t sample = 0;  ///< index in the fan
  Direction direction{};
  SineCosine unit_vector{0, 1};
  int32_t dx = 0, dy = 0;     ///< displacement of a leg, Q16 cells
  uint32_t mask_tiles = 0;    ///< size of the self-mask; 0: none
  uint32_t hidden_cells = 0;  ///< number of cells that it hides
  std::vector<Leg> legs;      ///< legs that were walked
  std::vector<PotentialHit> potential_hits;
  RayHit hit{};  ///< result before the sensor's noise
};

/// Receives the record of a ray whenever the ray is traced.
class RayObserver {
 public:
  virtual ~RayObserver() = default;
  /// The models in the record are valid during the call only.
  virtual void ReceiveRecord(const RayRecord& record) = 0;
};

}  // namespace Stg::internal::sensing

#endif
