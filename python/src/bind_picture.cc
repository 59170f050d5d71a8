// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "bindings.hh"
#include "gil.hh"
#include "picture.hh"
#include "pictures/picture.hh"
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

using SampleArray = nb::ndarray<nb::numpy, uint8_t, nb::ndim<3>>;

/// The samples of a PNG or PGM file: rows, columns, channels.
SampleArray ReadSamples(const std::string& path) {
  auto samples = std::make_unique<picture::Samples>();
  try {
    const GilRelease no_gil;
    *samples = picture::LoadSamples(path);
  } catch (const std::exception& error) {
    throw Failure{Kind::kStage, error.what()};
  }
  const picture::Samples& read = *samples;
  const size_t shape[] = {static_cast<size_t>(read.height), static_cast<size_t>(read.width),
                          static_cast<size_t>(read.channels)};
  uint8_t* const values = samples->values.data();
  const nb::capsule owner(samples.release(),
                          [](void* held) noexcept { delete static_cast<picture::Samples*>(held); });
  return SampleArray(values, 3, shape, owner);
}

}  // namespace

void BindPicture(nb::module_& module, nb::class_<Simulation>& world) {
  module.def("read_samples", &ReadSamples, nb::arg("path"));
  world
      .def("render", &Render, nb::arg("x"), nb::arg("y"), nb::arg("scale"), nb::arg("data"),
           nb::arg("to"))
      .def("fit", &Fit, nb::arg("width"), nb::arg("height"));
}

}  // namespace Stg::python
