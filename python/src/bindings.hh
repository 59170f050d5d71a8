// SPDX-License-Identifier: GPL-2.0-or-later
//
// The functions that add the bindings to the module, one per source file.

#ifndef STAGE_PYTHON_BINDINGS_HH
#define STAGE_PYTHON_BINDINGS_HH

#include <nanobind/nanobind.h>

#include <map>
#include <string>

#include "integers.hh"
#include "world/run_option.hh"

namespace Stg::python {

/// Values of the options of worlds by their names: arguments of World().
std::map<std::string, OptionValue> ValuesOf(const RunOptions& options);

class Batch;
class ModelHandle;
class Simulation;

void BindBelief(nanobind::module_& module);
void BindCast(nanobind::class_<Simulation>& world);
void BindField(nanobind::module_& module, nanobind::class_<Simulation>& world);
void BindLight(nanobind::class_<Simulation>& world);
void BindLog(nanobind::module_& module, nanobind::class_<Simulation>& world);
void BindLog(nanobind::class_<Batch>& batch);
void BindMap(nanobind::class_<Simulation>& world);
void BindModel(nanobind::module_& module);
void BindSensors(nanobind::module_& module, nanobind::class_<ModelHandle>& model);
void BindActuators(nanobind::module_& module, nanobind::class_<ModelHandle>& model);
void BindOptions(nanobind::module_& module);
void BindRosNames(nanobind::module_& module);
void BindPicture(nanobind::module_& module, nanobind::class_<Simulation>& world);
void BindCrowd(nanobind::module_& module);
void BindFeatures(nanobind::module_& module);
void BindRadio(nanobind::class_<Simulation>& world);
void BindScene(nanobind::module_& module, nanobind::class_<Simulation>& world);
void BindSections(nanobind::class_<Simulation>& world);
void BindSweep(nanobind::module_& module);
void BindWorld(nanobind::module_& module);

/// Switches a light or lightindicator. Returns false for other models.
bool SwitchLight(Model& model, bool on);

}  // namespace Stg::python

#endif
