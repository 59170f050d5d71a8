// SPDX-License-Identifier: GPL-2.0-or-later
//
// std::atomic_ref for libc++ before version 19, which lacks it. The toolchain file wasm.cmake
// includes this file into all others. A program without threads is sufficient: all operations are
// plain ones.

#ifndef STAGE_CMAKE_TOOLCHAINS_ATOMIC_REF_HH
#define STAGE_CMAKE_TOOLCHAINS_ATOMIC_REF_HH

#include <atomic>

#ifndef __cpp_lib_atomic_ref
#ifdef __EMSCRIPTEN_PTHREADS__
#error "This std::atomic_ref is for programs without threads"
#endif

namespace std {

template <typename T>
class atomic_ref {
 public:
  explicit atomic_ref(T& object) : object_(&object) {}

  T load(memory_order = memory_order_seq_cst) const { return *object_; }
  void store(T value, memory_order = memory_order_seq_cst) const { *object_ = value; }
  T exchange(T value, memory_order = memory_order_seq_cst) const { return Replace(value); }
  T fetch_add(T value, memory_order = memory_order_seq_cst) const {
    return Replace(*object_ + value);
  }
  T fetch_sub(T value, memory_order = memory_order_seq_cst) const {
    return Replace(*object_ - value);
  }
  T fetch_and(T value, memory_order = memory_order_seq_cst) const {
    return Replace(*object_ & value);
  }
  T fetch_or(T value, memory_order = memory_order_seq_cst) const {
    return Replace(*object_ | value);
  }
  bool compare_exchange_strong(T& expected, T value, memory_order = memory_order_seq_cst,
                               memory_order = memory_order_seq_cst) const {
    const bool equal = *object_ == expected;
    if (equal)
      *object_ = value;
    else
      expected = *object_;
    return equal;
  }
  bool compare_exchange_weak(T& expected, T value, memory_order = memory_order_seq_cst,
                             memory_order = memory_order_seq_cst) const {
    return compare_exchange_strong(expected, value);
  }

 private:
  T Replace(T value) const {
    const T old = *object_;
    *object_ = value;
    return old;
  }

  T* object_;
};

}  // namespace std
#endif

#endif
