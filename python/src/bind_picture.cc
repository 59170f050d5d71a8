// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <tuple>

#include "bindings.hh"
#include "gil.hh"
#include "picture.hh"
#include "simulation.hh"

namespace Stg::python {

namespace {

using Pixels = nb::ndarray<uint8_t, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

void Render(Simulation& simulation, double x, double y, double scale, bool data,
            const Pixels& pixels) {
  const View view{static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), x, y,
                  scale};
  simulation.With([&](World& world) {
    const GilRelease no_gil;
    DrawWorld(world, view, data, pixels.data());
  });
}

using Place = std::tuple<double, double, double>;

Place Fit(Simulation& simulation, int width, int height) {
  return simulation.With([&](World& world) {
    const View view = FittedView(world, width, height);
    return Place(view.x, view.y, view.scale);
  });
}

}  // namespace

void BindPicture(nb::class_<Simulation>& world) {
  world
      .def("render", &Render, nb::arg("x"), nb::arg("y"), nb::arg("scale"), nb::arg("data"),
           nb::arg("to"))
      .def("fit", &Fit, nb::arg("width"), nb::arg("height"));
}

}  // namespace Stg::python
