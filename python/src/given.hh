// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arguments that are checked here, so that what is wrong with them is said in the project's words.

#ifndef STAGE_PYTHON_GIVEN_HH
#define STAGE_PYTHON_GIVEN_HH

#include <nanobind/nanobind.h>

#include <string>
#include <type_traits>

#include "text.hh"

namespace Stg::python {

namespace nb = nanobind;

/// "found (1, 2) as pose, expected ...": a TypeError.
[[noreturn]] void RefuseArgument(nb::handle value, const char* name, const char* expected);

/// An argument that is to be a T. Python's tools see the type T; anything is accepted at first.
template <typename T>
struct Given {
  nb::object object;

  /// The value. TypeError if it is something else: `name` is that of the argument, `expected` says
  /// what it may be.
  T Value(const char* name, const char* expected) const {
    T value{};
    if (!nb::try_cast(object, value)) RefuseArgument(object, name, expected);
    return value;
  }
};

}  // namespace Stg::python

namespace nanobind::detail {

template <typename T>
struct type_caster<Stg::python::Given<T>> {
  NB_TYPE_CASTER(Stg::python::Given<T>, make_caster<T>::Name)

  bool from_python(handle source, uint32_t, cleanup_list*) noexcept {
    value.object = borrow(source);
    return true;
  }
  static handle from_cpp(const Stg::python::Given<T>& given, rv_policy, cleanup_list*) noexcept {
    return given.object.inc_ref();
  }
};

/// Python's None is accepted at first, like everything else.
template <typename T>
struct has_arg_defaults<Stg::python::Given<T>> : std::true_type {};

}  // namespace nanobind::detail

#endif
