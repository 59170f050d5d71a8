// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where models come from: the world of a Simulation, or the worlds of a Batch.

#ifndef STAGE_PYTHON_SOURCE_HH
#define STAGE_PYTHON_SOURCE_HH

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "failure.hh"
#include "models/model.hh"

namespace Stg::python {

/// Which model: that of this number, unless it was made after loading and the world has been reset
/// since, for then another one may have got its number.
struct ModelKey {
  uint32_t id;
  uint32_t resets;
};

class Crowd;

class Source {
 public:
  virtual ~Source() = default;

  // To be called while a Use is held, or by whoever makes or destroys the source.

  /// There still are worlds.
  virtual bool is_open() const = 0;
  /// Null if it is gone. Asks nothing that worlds share: it is called many times a step.
  virtual World* WorldAt(size_t index) const = 0;
  /// Null if it is gone.
  virtual Model* Find(size_t index, const ModelKey& key) const = 0;

  /// The crowd is about to be gone: its commands are given now.
  virtual void LetGo(Crowd*) noexcept {}

  /// Held by every binding that reads or changes the worlds, or what is known of them. It throws if
  /// another thread of Python holds one: long calls release the GIL, so two threads may try at
  /// once.
  class Use {
   public:
    explicit Use(Source* source) : source_(*source) {
      if (source_.in_use_.exchange(true))
        throw Failure{Kind::kStage,
                      "found the world in use by another thread, or by this very call"};
    }
    ~Use() { source_.in_use_ = false; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    Source& source_;
  };

 private:
  std::atomic<bool> in_use_{false};
};

}  // namespace Stg::python

#endif
