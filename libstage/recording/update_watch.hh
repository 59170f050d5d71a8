// SPDX-License-Identifier: GPL-2.0-or-later
//
// Which models have updated, as seen from outside: a model that updates plans its next update at
// once, one interval ahead.

#ifndef STAGE_RECORDING_UPDATE_WATCH_HH
#define STAGE_RECORDING_UPDATE_WATCH_HH

#include <vector>

#include "models/model.hh"

namespace Stg {
class Scheduler;
}

namespace Stg::recording {

class UpdateWatch {
 public:
  /// To be called after each step. One that was subscribed to in the step counts as well.
  void Look(Scheduler* scheduler, usec_t now);
  /// When the model has updated last; 0: never seen.
  usec_t LastUpdate(const Model& model) const {
    return model.GetId() < last_.size() ? last_[model.GetId()] : 0;
  }

 private:
  std::vector<usec_t> last_;  // by the model's number
};

}  // namespace Stg::recording

#endif
