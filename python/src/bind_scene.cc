// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <optional>

#include "bindings.hh"
#include "model_handle.hh"
#include "scene.hh"
#include "simulation.hh"
#include "text.hh"

namespace Stg::python {

namespace {

nb::bytes BytesOf(const std::string& text) { return nb::bytes(text.data(), text.size()); }

using Ids = nb::ndarray<const uint32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Places = nb::ndarray<float, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Flags = nb::ndarray<bool, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

void FillPlaces(Simulation& simulation, const Ids& ids, const Places& places,
                const Flags& stalled) {
  if (places.shape(0) != ids.shape(0) || stalled.shape(0) != ids.shape(0))
    throw nb::value_error("found arrays of another length than that of the numbers");
  simulation.With([&](World& world) {
    PlacesOf(world, ids.data(), ids.shape(0), places.data(), stalled.data());
  });
}

nb::bytes Scans(Simulation& simulation, const Ids& ids, size_t max_samples) {
  return BytesOf(simulation.With(
      [&](World& world) { return ScansOf(world, ids.data(), ids.shape(0), max_samples); }));
}

std::optional<ModelHandle> FindById(Simulation& simulation, uint32_t id) {
  return simulation.With([&](World& world) -> std::optional<ModelHandle> {
    const Model* const found = world.FindModel(id);
    if (!found) return std::nullopt;
    return ModelHandle(simulation.shared_from_this(), *found);
  });
}

}  // namespace

void BindScene(nb::module_& module, nb::class_<Simulation>& world) {
  nb::class_<Thing>(module, "Thing",
                    "A unit that moves as a whole: a robot, or another model on the ground with "
                    "everything on it.")
      .def_ro("id", &Thing::id)
      .def_ro("name", &Thing::name)
      .def_ro("type", &Thing::type)
      .def_ro("robot", &Thing::robot)
      .def_ro("movable", &Thing::movable)
      .def_ro("ground", &Thing::ground)
      .def_ro("top", &Thing::top)
      .def_prop_ro("shape", [](const Thing& thing) { return BytesOf(thing.shape); });
  world.def("things", [](Simulation& s) { return s.With([](World& w) { return ThingsOf(w); }); })
      .def(
          "body",
          [](Simulation& s, uint32_t id) {
            return BytesOf(s.With([&](World& w) {
              const Model* const model = w.FindModel(id);
              return model ? BodyOf(*model) : std::string();
            }));
          },
          nb::arg("id"))
      .def("find_id", &FindById, nb::arg("id"))
      .def("scene_key", [](Simulation& s) { return s.With([](World& w) { return SceneKey(w); }); })
      .def("places", &FillPlaces, nb::arg("ids"), nb::arg("places"), nb::arg("stalled"))
      .def("scans", &Scans, nb::arg("ids"), nb::arg("most"))
      .def("glows",
           [](Simulation& s) { return BytesOf(s.With([](World& w) { return GlowsOf(w); })); });
}

}  // namespace Stg::python
