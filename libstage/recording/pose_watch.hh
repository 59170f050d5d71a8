// SPDX-License-Identifier: GPL-2.0-or-later
//
// Which models of a world are not where they were when the log began.

#ifndef STAGE_RECORDING_POSE_WATCH_HH
#define STAGE_RECORDING_POSE_WATCH_HH

#include <vector>

#include "models/model.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

/// The first look gives all models, each later one those that have been elsewhere at any look
/// since, or are new: so a replay needs the first and the last of them, and none between.
class PoseWatch {
 public:
  const std::vector<ModelPose>& Look(const std::vector<Model*>& models);

 private:
  struct Known {
    bool there = false, moved = false;
    uint32_t parent = 0;
    double x = 0, y = 0, z = 0, a = 0;
  };
  bool IsToBeTold(const Model& model, const ModelPose& now);

  bool begun_ = false;
  std::vector<Known> known_;  // by the model's number
  std::vector<ModelPose> found_;
};

}  // namespace Stg::recording

#endif
