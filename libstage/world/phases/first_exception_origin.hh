// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_WORLD_PHASES_FIRST_EXCEPTION_ORIGIN_HH
#define STAGE_WORLD_PHASES_FIRST_EXCEPTION_ORIGIN_HH

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <mutex>

#include "models/exception_origin.hh"

namespace Stg {

/// Carries the name of a thrower from a worker to the thread that started the job. The pool
/// rethrows the exception with the lowest index in the job; the name must belong to that one.
class FirstExceptionOrigin {
 public:
  /// Call it before the job begins.
  void Begin() {
    index_ = SIZE_MAX;
    text_[0] = '\0';
  }
  /// Call it in the worker thread after item `index` has thrown and noted its name.
  void Note(std::size_t index) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (index < index_) {
      index_ = index;
      std::snprintf(text_, sizeof text_, "%s", ExceptionOrigin());
    }
    ClearExceptionOrigin();
  }
  /// Call it in the thread that started the job, when the exception arrives there.
  void Publish() const { SetExceptionOrigin(text_); }

 private:
  std::mutex mutex_;
  std::size_t index_ = SIZE_MAX;
  char text_[400] = "";
};

}  // namespace Stg

#endif
