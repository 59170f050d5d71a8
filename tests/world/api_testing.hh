// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_API_TESTING_HH
#define STAGE_TESTS_API_TESTING_HH

#include <gtest/gtest.h>

#include <sstream>
#include <type_traits>

#include "stage.hh"

// What the tests of the interface share. Like most clients, they use both namespaces as a whole.
using namespace Stg;
using namespace std;

/// Compiles if something converts to the type: for pointers to functions and members, which are of
/// that type exactly (or of a base class).
template <class Type>
void Has(Type) {}

template <class Type, class Actual>
void Is(const Actual&) {
  static_assert(is_same<Type, Actual>::value, "another type is promised");
}

#endif
