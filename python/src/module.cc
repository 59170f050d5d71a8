// SPDX-License-Identifier: GPL-2.0-or-later
//
// stagesim._core: the compiled part of the package. The public classes are in stagesim/*.py.

#include <nanobind/nanobind.h>

#include "bindings.hh"
#include "failure.hh"
#include "gil.hh"
#include "stage.hh"
#include "text.hh"
#include "threads/processors.hh"

NB_MODULE(_core, module) {
  using namespace Stg::python;
  Stg::Init(nullptr, nullptr);
  ParkThreadsAtExit();
  BindFailures(module);
  BindModel(module);
  BindCrowd(module);
  BindBelief(module);
  BindFeatures(module);
  BindOptions(module);
  BindRosNames(module);
  BindWorld(module);
  BindSweep(module);
  module.def("count_processors", &Stg::threads::CountUsableProcessors,
             "Processors that this process may use, by its affinity mask and control groups.");
  module.def("version", &Stg::Version, "The version of the simulator.");
}
