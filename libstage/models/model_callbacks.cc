// SPDX-License-Identifier: GPL-2.0-or-later
//
// Calling callbacks, which may change or delete the model and its world.

#include <algorithm>

#include "geometry/load_error.hh"
#include "messages/assert.hh"
#include "models/exception_origin.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

void Model::AddCallback(callback_type_t t, model_callback_t cb, void* user) {
  AddCallback(Callback{cb, user, t, false});
  serial_update_callbacks_ |= t == CB_UPDATE;
}

void Model::AddParallelCallback(callback_type_t t, model_callback_t cb, void* user) {
  AddCallback(Callback{cb, user, t, true});
}

void Model::Adopt(const std::shared_ptr<void>& data) { adopted_.push_front(data); }

void Model::AddCallback(const Callback& entry) {
  if (!callbacks_) callbacks_ = std::make_shared<Callbacks>();
  if (entry.type == CB_CONTACT) host().contact_callbacks++;
  std::vector<Callback>& all = callbacks_->all;
  if (std::find(all.begin(), all.end(), entry) == all.end()) all.push_back(entry);
}

int Model::RemoveCallback(callback_type_t t, model_callback_t callback) {
  if (!callbacks_) return 0;
  // During a round, entries are only set to null, because a loop is running over them.
  for (Callback& entry : callbacks_->all)
    if (entry.type == t && entry.function == callback) entry.function = nullptr;
  if (callbacks_->rounds == 0) callbacks_->Tidy();
  return callbacks_->CountLeft(t);
}

int Model::Callbacks::CountLeft(callback_type_t t) const {
  return static_cast<int>(std::count_if(
      all.begin(), all.end(), [t](const Callback& c) { return c.type == t && c.function; }));
}

void Model::Callbacks::Tidy() {
  std::erase_if(all, [](const Callback& c) { return !c.function; });
}

/// Lifetime of a loop over the callbacks, which may throw.
struct Model::Callbacks::Round {
  explicit Round(Callbacks* callbacks) : all(callbacks) { all->rounds++; }
  ~Round() {
    STAGE_ASSERT(all->rounds > 0);
    if (--all->rounds == 0) all->Tidy();
  }
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;
  Callbacks* all;
};

/// Counts callbacks running outside of a step; those of a step may run on several threads.
class CallOutsideOfStep {
 public:
  explicit CallOutsideOfStep(Host& host) {
    if (host.stepping) return;
    host_ = host.shared_from_this();
    host_->calls++;
  }
  ~CallOutsideOfStep() {
    STAGE_ASSERT(!host_ || host_->calls > 0);
    if (host_) host_->calls--;
  }
  CallOutsideOfStep(const CallOutsideOfStep&) = delete;
  CallOutsideOfStep& operator=(const CallOutsideOfStep&) = delete;

 private:
  std::shared_ptr<Host> host_;  // a callback may delete the world
};

/// Calls call(entry) for each callback of the type. Returns how many callbacks remain.
template <typename F>
int Model::CallEach(callback_type_t t, F call) {
  if (!HasCallbacks(t)) return 0;
  // A callback may read readings of other models and change what they see.
  host().TraceBatch();
  // By index: a callback may add callbacks (called from the next round on), remove some, or delete
  // the model. After a deletion, the rest is skipped and the model is not touched.
  const std::shared_ptr<Callbacks> callbacks = callbacks_;
  const RandomScope random_numbers(&random_);
  const size_t count = callbacks->all.size();
  const Callbacks::Round round(callbacks.get());
  const CallOutsideOfStep call_outside_of_step(host());
  for (size_t i = 0; i < count && !callbacks->model_deleted; i++) {
    STAGE_ASSERT(i < callbacks->all.size());  // entries are erased only after the last round
    const Callback entry = callbacks->all[i];
    if (entry.type != t || !entry.function) continue;
    try {
      if (call(entry) != 0) callbacks->all[i].function = nullptr;
    } catch (...) {
      RecordExceptionOrigin("a callback", callbacks->model_deleted ? nullptr : this,
                            reinterpret_cast<void (*)()>(entry.function));
      throw;
    }
  }
  return callbacks->CountLeft(t);
}

int Model::CallCallbacks(callback_type_t t) {
  return CallEach(t, [this](const Callback& entry) { return entry.function(this, entry.user); });
}

bool Model::SurvivesCallbacks(callback_type_t t) {
  if (!HasCallbacks(t)) return true;
  const std::shared_ptr<Callbacks> callbacks = callbacks_;
  CallCallbacks(t);
  return !callbacks->model_deleted;
}

/// Calls the Init callbacks. Turns exceptions of controllers into a LoadError.
void Model::InitOrThrow() {
  if (!HasCallbacks(CB_INIT)) return;
  const std::string where = wf ? wf->Where(wf_entity, "ctrl") + ": " : "";  // Init may delete it
  const std::string name = token;
  const std::shared_ptr<Host> keeper = host().shared_from_this();
  CallEach(CB_INIT, [&](const Callback& entry) {
    try {
      return entry.function(this, entry.user);
    } catch (...) {
      throw LoadError(where + keeper->DescribeInitFailure(name, entry.user), 255);
    }
  });
}

}  // namespace Stg
