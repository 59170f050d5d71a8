// SPDX-License-Identifier: GPL-2.0-or-later
//
// Commands to the models of a row, and sightings of them. They have the results of the functions of
// the models of a World in the same state.

#ifndef STAGE_WHATIF_ROW_MODELS_HH
#define STAGE_WHATIF_ROW_MODELS_HH

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "rows/row_backend.hh"
#include "rows/rows.hh"
#include "whatif/branches.hh"

namespace Stg::whatif {

class RowModels {
 public:
  RowModels(const rows::Scene& scene, const std::vector<uint32_t>& watched);

  const rows::Scene& scene() const { return scene_; }
  /// True if the command can be carried out in a row. Throws CommandRefused if nobody obeys it.
  bool CanApply(const Command& command) const;
  void Apply(const Command& command, rows::Rows* rows, size_t row) const;
  /// Returns a command that CanApply() for a device, or nothing if it has no effect.
  std::optional<row_given_t> Given(const Command& command, size_t row) const;
  /// Appends the sightings of all watched models.
  void Watch(const rows::Rows& rows, size_t row, std::vector<Sighting>* to) const;
  /// The movers of these models, for DeviceRows::Watch().
  const std::vector<uint32_t>& watched_movers() const { return watched_movers_; }
  /// Does the same from the numbers of DeviceRows::ReadWatched() for a world.
  void Watch(const double* numbers, std::vector<Sighting>* to) const;

 private:
  static constexpr size_t kStands = SIZE_MAX;
  struct Watched {
    size_t mover = kStands;
    size_t place = 0;  ///< of the mover, in watched_movers_
    uint32_t node = 0;
    Sighting seen = {Pose(), Velocity(), false};  ///< with what does not change
  };
  Watched Find(uint32_t model) const;
  /// A mover as it is after a step.
  struct Seen {
    rows::Planar pose, velocity;
    bool stalled;
  };
  Sighting See(const Watched& watched, const Seen& seen) const;
  /// The number of the robot's mover; kStands if the model is no robot.
  size_t RobotOf(uint32_t model) const;

  const rows::Scene& scene_;
  std::vector<Watched> watched_;
  std::vector<uint32_t> watched_movers_;
};

}  // namespace Stg::whatif

#endif
