// SPDX-License-Identifier: GPL-2.0-or-later
//
// The sections of a world file, for values that vary between worlds of a batch.

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <utility>
#include <vector>

#include "bindings.hh"
#include "failure.hh"
#include "rows/row_bridge.hh"
#include "simulation.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg::python {

namespace {

template <typename F>
auto WithFile(Simulation& simulation, F f) {
  return simulation.With([&](World& world) {
    Worldfile* const file = world.GetWorldFile();
    if (!file) throw Failure{Kind::kGone, "the world has no world file"};
    return f(*file);
  });
}

/// The type of each section and the number of the one around it; -1: none.
std::vector<std::pair<std::string, int>> SectionsOf(Simulation& simulation) {
  return WithFile(simulation, [](Worldfile& file) {
    std::vector<std::pair<std::string, int>> sections;
    for (int i = 0; i < file.GetEntityCount(); i++)
      sections.emplace_back(file.GetEntityType(i), file.GetEntityParent(i));
    return sections;
  });
}

/// The values of a property as the file has them; empty if it lacks the property.
std::vector<std::string> TextsOf(Simulation& simulation, int section, const std::string& property) {
  return WithFile(simulation, [&](Worldfile& file) {
    std::vector<std::string> texts;
    const size_t count = file.TupleLength(section, property.c_str());
    for (size_t i = 0; i < count; i++)
      texts.push_back(file.ReadElement(section, property.c_str(), i));
    return texts;
  });
}

bool IsCalled(Simulation& simulation, int section, const std::string& selector) {
  return WithFile(simulation, [&](Worldfile& file) {
    return section >= 0 && section < file.GetEntityCount() && file.IsCalled(section, selector);
  });
}

std::vector<std::string> AskedNames(Simulation& simulation) {
  return WithFile(simulation, [](Worldfile& file) { return file.AskedNames(); });
}

/// True if rows can give each world another number of this property of a model, or of the sensor
/// with this number of a ranger.
bool CanVary(Simulation& simulation, uint32_t model, uint32_t sensor, const std::string& property) {
  return simulation.With([&](World& world) {
    return RowBridge::WhyNotClosed(world).empty() &&
           RowBridge::CanVary(world, {model, sensor, RowBridge::FindProperty(property), 0});
  });
}

}  // namespace

void BindSections(nb::class_<Simulation>& world) {
  world.def("sections", &SectionsOf)
      .def("section_texts", &TextsOf, nb::arg("section"), nb::arg("property"))
      .def("is_called", &IsCalled, nb::arg("section"), nb::arg("selector"))
      .def("asked_names", &AskedNames)
      .def("can_vary", &CanVary, nb::arg("model"), nb::arg("sensor"), nb::arg("property"));
}

}  // namespace Stg::python
