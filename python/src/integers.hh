// SPDX-License-Identifier: GPL-2.0-or-later
//
// Conversion of integers between Python and C++, replacing nanobind's own.
//
// An integer argument in C++ accepts every Python object with __index__(), such as NumPy's
// integers, but no bool: passing True for a number is mostly a mistake. Floats are refused too,
// even if they are whole.

#ifndef STAGE_PYTHON_INTEGERS_HH
#define STAGE_PYTHON_INTEGERS_HH

#include <nanobind/nanobind.h>

#include <limits>
#include <type_traits>

namespace nanobind::detail {

/// True for Python's bool and NumPy's bool. The latter is recognized by its name ("bool_" before
/// version 2), so that NumPy need not be loaded.
inline bool is_bool(handle value) noexcept {
  if (PyLong_Check(value.ptr())) return PyBool_Check(value.ptr());
  const object name = steal(PyObject_GetAttrString(value.type().ptr(), "__name__"));
  if (!name.is_valid()) {
    PyErr_Clear();
    return false;
  }
  return PyUnicode_Check(name.ptr()) &&
         (PyUnicode_CompareWithASCIIString(name.ptr(), "bool") == 0 ||
          PyUnicode_CompareWithASCIIString(name.ptr(), "bool_") == 0);
}

template <typename T>
struct integer_caster {
  NB_TYPE_CASTER(T, const_name("int"))

  bool from_python(handle source, uint32_t, cleanup_list*) noexcept {
    if (!PyIndex_Check(source.ptr()) || is_bool(source)) return false;
    const object number = steal(PyNumber_Index(source.ptr()));
    if (number.is_valid() && Read(number)) return true;
    PyErr_Clear();
    return false;
  }

  static handle from_cpp(T number, rv_policy, cleanup_list*) noexcept {
    if constexpr (std::is_signed_v<T>)
      return PyLong_FromLongLong(number);
    else
      return PyLong_FromUnsignedLongLong(number);
  }

 private:
  /// Returns false if the number is out of range; a Python error may then be set.
  bool Read(handle number) noexcept {
    using Limits = std::numeric_limits<T>;
    if constexpr (std::is_signed_v<T>) {
      const long long read = PyLong_AsLongLong(number.ptr());
      value = static_cast<T>(read);
      return !(read == -1 && PyErr_Occurred()) && read >= Limits::min() && read <= Limits::max();
    } else {
      const unsigned long long read = PyLong_AsUnsignedLongLong(number.ptr());
      value = static_cast<T>(read);
      return !(read == ~0ull && PyErr_Occurred()) && read <= Limits::max();
    }
  }
};

template <>
struct type_caster<int> : integer_caster<int> {};
template <>
struct type_caster<unsigned> : integer_caster<unsigned> {};
template <>
struct type_caster<long> : integer_caster<long> {};
template <>
struct type_caster<unsigned long> : integer_caster<unsigned long> {};
template <>
struct type_caster<long long> : integer_caster<long long> {};
template <>
struct type_caster<unsigned long long> : integer_caster<unsigned long long> {};

}  // namespace nanobind::detail

#endif
