// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arguments that the bindings check themselves, so that errors are worded like all others.

#ifndef STAGE_PYTHON_CHECKED_ARGUMENT_HH
#define STAGE_PYTHON_CHECKED_ARGUMENT_HH

#include <nanobind/nanobind.h>

#include <string>
#include <type_traits>

#include "integers.hh"
#include "text.hh"

namespace Stg::python {

namespace nb = nanobind;

/// Throws a TypeError such as "found (1, 2) as pose, expected ...".
[[noreturn]] void RefuseArgument(nb::handle value, const char* name, const char* expected);

/// An argument of type T. Its type hint is T, but any object is accepted until Value() is called.
template <typename T>
struct CheckedArgument {
  nb::object object;

  /// Converts the object. Throws TypeError if it is no T; `name` is the argument's name, and
  /// `expected` describes valid values.
  T Value(const char* name, const char* expected) const {
    T value{};
    if (!nb::try_cast(object, value)) RefuseArgument(object, name, expected);
    return value;
  }
};

}  // namespace Stg::python

namespace nanobind::detail {

template <typename T>
struct type_caster<Stg::python::CheckedArgument<T>> {
  NB_TYPE_CASTER(Stg::python::CheckedArgument<T>, make_caster<T>::Name)

  bool from_python(handle source, uint32_t, cleanup_list*) noexcept {
    value.object = borrow(source);
    return true;
  }
  static handle from_cpp(const Stg::python::CheckedArgument<T>& given, rv_policy,
                         cleanup_list*) noexcept {
    return given.object.inc_ref();
  }
};

/// Lets nanobind pass None through, too.
template <typename T>
struct has_arg_defaults<Stg::python::CheckedArgument<T>> : std::true_type {};

}  // namespace nanobind::detail

#endif
