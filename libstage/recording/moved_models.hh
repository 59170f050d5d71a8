// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tracks which models of a world have moved since its log began.

#ifndef STAGE_RECORDING_MOVED_MODELS_HH
#define STAGE_RECORDING_MOVED_MODELS_HH

#include <vector>

#include "models/model.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

/// The first call returns all models. Later calls return the models that have moved since then at
/// any earlier call, or are new. A replay therefore needs only the first and the latest result.
class MovedModels {
 public:
  const std::vector<ModelPose>& FindMoved(const std::vector<Model*>& models);

 private:
  struct Tracked {
    bool there = false, moved = false;
    uint32_t parent = 0;
    double x = 0, y = 0, z = 0, a = 0;
  };
  bool MustBeLogged(const Model& model, const ModelPose& now);

  bool begun_ = false;
  std::vector<Tracked> tracked_;  // indexed by model id
  std::vector<ModelPose> found_;
};

}  // namespace Stg::recording

#endif
