// SPDX-License-Identifier: GPL-2.0-or-later
//
// The memory behind an array that NumPy views.

#ifndef STAGE_PYTHON_ARRAY_HH
#define STAGE_PYTHON_ARRAY_HH

#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <vector>

#include "messages/assert.hh"

namespace Stg::python {

/// A dense array in C order, indexed [world][robot]... Make() allocates its memory, set to 0.
class Array {
 public:
  template <typename T>
  void Make(std::vector<size_t> shape) {
    shape_ = std::move(shape);
    dtype_ = nanobind::dtype<T>();
    size_t count = 1;
    for (const size_t length : shape_) count *= length;
    bytes_.reset(std::calloc(count > 0 ? count : 1, sizeof(T)));
    if (!bytes_) throw std::bad_alloc();
    row_ = shape_.size() > 2 ? count / std::max<size_t>(1, shape_[0] * shape_[1]) : 1;
  }
  bool exists() const { return bytes_ != nullptr; }
  /// The first of the row() elements of a robot.
  template <typename T>
  T* Row(size_t world, size_t robot) const {
    STAGE_ASSERT(exists() && shape_.size() >= 2 && dtype_ == nanobind::dtype<T>());
    STAGE_ASSERT(world < shape_[0] && (robot < shape_[1] || (robot == 0 && shape_[1] == 0)));
    return static_cast<T*>(bytes_.get()) + (world * shape_[1] + robot) * row_;
  }
  size_t row() const { return row_; }
  void* data() const { return bytes_.get(); }
  const std::vector<size_t>& shape() const { return shape_; }
  nanobind::dlpack::dtype dtype() const { return dtype_; }

 private:
  struct Free {
    void operator()(void* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<void, Free> bytes_;
  std::vector<size_t> shape_;
  nanobind::dlpack::dtype dtype_{};
  size_t row_ = 0;  // elements per robot
};

}  // namespace Stg::python

#endif
