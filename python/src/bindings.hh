// SPDX-License-Identifier: GPL-2.0-or-later
//
// The parts that the module is put together from.

#ifndef STAGE_PYTHON_BINDINGS_HH
#define STAGE_PYTHON_BINDINGS_HH

#include <nanobind/nanobind.h>

namespace Stg::python {

}  // namespace Stg::python

#endif
