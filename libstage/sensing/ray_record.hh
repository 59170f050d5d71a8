// SPDX-License-Identifier: GPL-2.0-or-later
//
// Why a ray's range is what it is: the fan, the walk, the bodies that were asked and what each
// answered. The tracer itself writes it down, for pictures and for those who ask.

#ifndef STAGE_SENSING_RAY_RECORD_HH
#define STAGE_SENSING_RAY_RECORD_HH

#include <cstdint>
#include <vector>

#include "sensing/fan.hh"
#include "sensing/ray_hit.hh"
#include "sensing/walk_record.hh"

namespace Stg::internal::sensing {

struct RayRecord {
  /// What became of a body in a cell of the walk.
  enum class Answer : uint8_t {
    kOtherHeight,  ///< the ray passes above it or below it
    kMissed,   ///< exact model: the ray crosses none of its edges, or only behind the nearest hit
    kRefused,  ///< the predicate lets the ray pass
    kAccepted  ///< the predicate takes it for a hit
  };
  struct Question {
    const Model* model;
    double z_min, z_max;  ///< of the body, global, metres
    Answer answer;
    double along;  ///< exact model, if the predicate was asked: metres to the crossing
  };
  /// An occupied cell that the ray came to.
  struct PotentialHit {
    int32_t x, y;
    double middle;  ///< metres from the start to the middle of the ray's way through the cell
    std::vector<Question>
        questions;  ///< in the order of drawing; none: bodies of the other drawing
  };
  struct Leg {
    double number;  ///< from 0
    std::vector<WalkStep> steps;
  };

  Fan fan;
  uint32_t sample = 0;  ///< of the fan
  Direction direction{};
  SineCosine turn{0, 1};
  int32_t dx = 0, dy = 0;     ///< displacement of a leg, Q16 cells
  uint32_t mask_tiles = 0;    ///< of the mask that hides the finder's own tree; 0: none
  uint32_t hidden_cells = 0;  ///< by it
  std::vector<Leg> legs;      ///< those that were walked
  std::vector<PotentialHit> potential_hits;
  RayHit hit{};  ///< what the sensor gets, before noise
};

/// Gets the record of a ray whenever it is traced.
class RayObserver {
 public:
  virtual ~RayObserver() = default;
  /// The models in the record are there now; later they may not be.
  virtual void TakeRecord(const RayRecord& record) = 0;
};

}  // namespace Stg::internal::sensing

#endif
