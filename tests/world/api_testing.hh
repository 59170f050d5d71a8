// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_API_TESTING_HH
#define STAGE_TESTS_API_TESTING_HH

#include <gtest/gtest.h>

#include <sstream>
#include <type_traits>

#include "stage.hh"

// Helpers for tests of the interface. Like most clients, they have using-directives for both
// namespaces.
using namespace Stg;
using namespace std;

/// Compiles if the argument converts to `Type`. Pointers to functions and members must have exactly
/// that type, or belong to a base class.
template <class Type>
void Has(Type) {}

template <class Type, class Actual>
void Is(const Actual&) {
  static_assert(is_same<Type, Actual>::value, "another type is promised");
}

#endif
