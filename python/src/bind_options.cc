// SPDX-License-Identifier: GPL-2.0-or-later
//
// The table of the options of worlds.

#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "bindings.hh"
#include "text.hh"

namespace Stg::python {

namespace {

namespace nb = nanobind;

const char* KindOf(const RunOption& option) {
  constexpr const char* kKinds[] = {"switch", "number", "seconds", "choice", "device", "texts"};
  return kKinds[static_cast<size_t>(option.type)];
}

}  // namespace

std::map<std::string, OptionValue> ValuesOf(const RunOptions& options) {
  std::map<std::string, OptionValue> values;
  for (const RunOption& option : RunOptionTable())
    if (option.of_world) values[option.name] = option.get(options);
  return values;
}

void BindOptions(nb::module_& module) {
  nb::class_<RunOption>(module, "RunOption", "An option of worlds, in the table of all.")
      .def_ro("name", &RunOption::name)
      .def_ro("flag", &RunOption::flag)
      .def_prop_ro("kind", &KindOf)
      .def_ro("placeholder", &RunOption::placeholder)
      .def_ro("changes_results", &RunOption::changes_results)
      .def_ro("min", &RunOption::min)
      .def_ro("max", &RunOption::max)
      .def_ro("choices", &RunOption::choices)
      .def_ro("of_world", &RunOption::of_world)
      .def_prop_ro("default", &RunOption::Default)
      .def_prop_ro("summary", &RunOption::Summary)
      .def_prop_ro("expected", &RunOption::Expected);
  module.def("run_options", &RunOptionTable);
}

}  // namespace Stg::python
