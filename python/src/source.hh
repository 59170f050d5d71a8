// SPDX-License-Identifier: GPL-2.0-or-later
//
// The interface to the worlds that models live in: the one of a Simulation, or those of a Batch.

#ifndef STAGE_PYTHON_SOURCE_HH
#define STAGE_PYTHON_SOURCE_HH

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "failure.hh"
#include "models/model.hh"
#include "worlds/world_pool.hh"

namespace Stg::python {

/// Identifies a model across resets. Models of the world file keep their ids. The id of a model
/// created later is valid only until the next reset, after which another model may get it.
struct ModelKey {
  uint32_t id;
  uint32_t resets;
};

class Crowd;

class Source {
 public:
  virtual ~Source() = default;

  // The caller holds a Use, or is constructing or destroying the source.

  /// False if the world has been closed or deleted.
  virtual bool is_open() const = 0;
  /// Null if the world is gone. It takes no lock, because it is called many times per step.
  virtual World* WorldAt(size_t index) const = 0;
  /// Null if the model is gone.
  virtual Model* Find(size_t index, const ModelKey& key) const = 0;

  /// The pool that the worlds belong to, with their indices as ids; null if there is none.
  virtual WorldPool* pool() const { return nullptr; }

  /// Called by the destructor of a crowd: applies its pending commands.
  virtual void OnCrowdDestroyed(Crowd*) noexcept {}

  /// Exclusive access to the source; every binding that reads or changes the worlds holds one. The
  /// constructor throws if one is held, which is possible because long calls release the GIL.
  class Use {
   public:
    explicit Use(Source* source) : source_(*source) {
      if (source_.in_use_.exchange(true))
        throw Failure{Kind::kStage,
                      "found the world in use by another thread, or by this very call"};
    }
    ~Use() {
      source_.in_use_ = false;
      source_.CallWaiting();
    }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    Source& source_;
  };

  /// Calls f() as soon as nobody holds a Use: now, or when the present one ends, maybe in another
  /// thread. f must not throw, nor keep the last pointer to this source.
  void CallWhenFree(std::function<void()> f) {
    {
      const std::lock_guard lock(mutex_);
      waiting_.push_back(std::move(f));
      has_waiting_ = true;
    }
    CallWaiting();
  }

 private:
  /// The end of each Use looks at has_waiting_ after giving the source free, so no call is
  /// forgotten.
  void CallWaiting() {
    while (has_waiting_ && !in_use_.exchange(true)) {
      std::vector<std::function<void()>> calls;
      {
        const std::lock_guard lock(mutex_);
        calls.swap(waiting_);
        has_waiting_ = false;
      }
      for (const std::function<void()>& call : calls) call();
      in_use_ = false;
    }
  }

  std::atomic<bool> in_use_{false};
  std::atomic<bool> has_waiting_{false};
  std::mutex mutex_;                            // guards waiting_
  std::vector<std::function<void()>> waiting_;  // see CallWhenFree()
};

}  // namespace Stg::python

#endif
