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
  void Make(std::vector<size_t> shape, nanobind::dlpack::dtype dtype) {
    shape_ = std::move(shape);
    dtype_ = dtype;
    size_t count = 1;
    for (const size_t length : shape_) count *= length;
    bytes_.reset(std::calloc(count > 0 ? count : 1, dtype.bits / 8));
    if (!bytes_) throw std::bad_alloc();
    row_ = shape_.size() > 2 ? count / std::max<size_t>(1, shape_[0] * shape_[1]) : 1;
  }
  template <typename T>
  void Make(std::vector<size_t> shape) {
    Make(std::move(shape), nanobind::dtype<T>());
  }
  bool exists() const { return bytes_ != nullptr; }
  /// The first of the row() elements of a robot.
  template <typename T>
  T* Row(size_t world, size_t robot) const {
    STAGE_ASSERT(dtype_ == nanobind::dtype<T>());
    return static_cast<T*>(Row(world, robot));
  }
  void* Row(size_t world, size_t robot) const {
    STAGE_ASSERT(exists() && shape_.size() >= 2);
    STAGE_ASSERT(world < shape_[0] && (robot < shape_[1] || (robot == 0 && shape_[1] == 0)));
    return static_cast<char*>(bytes_.get()) +
           (world * shape_[1] + robot) * row_ * (dtype_.bits / 8);
  }
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

/// A NumPy view of an array, without its first axis if `drops_first`. It keeps `owner` alive.
template <typename T>
nanobind::object ViewOf(const Array& array, const std::shared_ptr<T>& owner, bool writable,
                        bool drops_first = false) {
  namespace nb = nanobind;
  const nb::capsule held(new std::shared_ptr<T>(owner),
                         [](void* of) noexcept { delete static_cast<std::shared_ptr<T>*>(of); });
  const size_t* const lengths = array.shape().data() + drops_first;
  const size_t axes = array.shape().size() - drops_first;
  if (writable)
    return nb::cast(
        nb::ndarray<nb::numpy>(array.data(), axes, lengths, held, nullptr, array.dtype()));
  return nb::cast(
      nb::ndarray<nb::numpy, nb::ro>(array.data(), axes, lengths, held, nullptr, array.dtype()));
}

}  // namespace Stg::python

#endif
