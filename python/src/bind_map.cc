// SPDX-License-Identifier: GPL-2.0-or-later
//
// Maps of the scenery of a world.

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "bindings.hh"
#include "gil.hh"
#include "models/host.hh"
#include "recording/occupancy_map.hh"
#include "simulation.hh"

namespace Stg::python {

namespace {

using recording::OccupancyMap;
using recording::Scenery;

using Rectangle = std::tuple<double, double, double, double>;  // x and y of the least and the most
using Place = std::tuple<double, double, double>;
using Cells = nb::ndarray<nb::numpy, int8_t, nb::ndim<2>>;

/// The smallest rectangle around the scenery; none without scenery.
std::optional<Rectangle> SceneryBounds(Simulation& simulation, std::optional<double> height) {
  return simulation.With([&](World& world) -> std::optional<Rectangle> {
    const Scenery scenery(world.host().models, height);
    if (scenery.x().max < scenery.x().min) return std::nullopt;
    return Rectangle(scenery.x().min, scenery.y().min, scenery.x().max, scenery.y().max);
  });
}

/// A number that changes when the scenery does.
uint64_t SceneryFingerprint(Simulation& simulation, std::optional<double> height) {
  return simulation.With(
      [&](World& world) { return Scenery(world.host().models, height).Fingerprint(); });
}

/// Cells of the scenery: 0 or 100, in rows from the lowest on.
Cells DrawScenery(Simulation& simulation, std::optional<double> height, uint32_t rows,
                  uint32_t columns, double resolution, const Place& origin) {
  auto map = std::make_unique<OccupancyMap>();
  map->resolution = resolution;
  map->height = rows;
  map->width = columns;
  map->origin = Pose(std::get<0>(origin), std::get<1>(origin), 0, std::get<2>(origin));
  simulation.With([&](World& world) {
    const GilRelease no_gil;
    map->cells.assign(size_t{rows} * columns, 0);
    Scenery(world.host().models, height).Draw(map.get());
  });
  const size_t shape[] = {rows, columns};
  int8_t* const cells = map->cells.data();
  const nb::capsule owner(map.release(),
                          [](void* held) noexcept { delete static_cast<OccupancyMap*>(held); });
  return Cells(cells, 2, shape, owner);
}

}  // namespace

void BindMap(nb::class_<Simulation>& world) {
  world.def("scenery_bounds", &SceneryBounds, nb::arg("height").none())
      .def("scenery_fingerprint", &SceneryFingerprint, nb::arg("height").none())
      .def("draw_scenery", &DrawScenery, nb::arg("height").none(), nb::arg("rows"),
           nb::arg("columns"), nb::arg("resolution"), nb::arg("origin"));
}

}  // namespace Stg::python
