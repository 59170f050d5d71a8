// SPDX-License-Identifier: GPL-2.0-or-later
//
// Fields as arrays: the compiled part of stagesim.Field.

#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "bindings.hh"
#include "model_handle.hh"

namespace Stg::python {

namespace nb = nanobind;

namespace {

using FieldGrid = nb::ndarray<double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using ConstFieldGrid = nb::ndarray<const double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using PlacesOnFloor = nb::ndarray<const double, nb::shape<-1, 2>, nb::c_contig, nb::device::cpu>;
using Amounts = nb::ndarray<const double, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using FieldResults = nb::ndarray<double, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using DoneFlags = nb::ndarray<bool, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

ModelField& AsField(Model& model) { return As<ModelField>(model, "field"); }

template <typename Grid>
void CheckShape(const ModelField& field, const Grid& grid) {
  if (grid.shape(0) != field.rows() || grid.shape(1) != field.columns())
    throw nb::value_error("found an array of another shape than that of the field");
}

void CopyValues(const ModelHandle& handle, const FieldGrid& to) {
  handle.With([&](Model& model) {
    const ModelField& field = AsField(model);
    CheckShape(field, to);
    std::ranges::copy(field.values(), to.data());
  });
}

void SetFieldValues(const ModelHandle& handle, const ConstFieldGrid& from) {
  handle.With([&](Model& model) {
    ModelField& field = AsField(model);
    CheckShape(field, from);
    if (!field.SetValues(from.data(), from.size()))
      throw nb::value_error("found a value that is not finite or beyond 1e100");
  });
}

void ReadPlaces(const ModelHandle& handle, const PlacesOnFloor& places, bool linear,
                const FieldResults& to) {
  handle.With([&](Model& model) {
    const ModelField& field = AsField(model);
    const double* at = places.data();
    for (size_t i = 0; i < places.shape(0) && i < to.size(); i++, at += 2)
      to.data()[i] = linear ? field.LinearValue(at[0], at[1]) : field.NearestValue(at[0], at[1]);
  });
}

void DepositAll(const ModelHandle& handle, const PlacesOnFloor& places, const Amounts& amounts,
                const DoneFlags& done) {
  handle.With([&](Model& model) {
    ModelField& field = AsField(model);
    const size_t count = std::min({places.shape(0), amounts.size(), done.size()});
    const double* at = places.data();
    for (size_t i = 0; i < count; i++, at += 2)
      done.data()[i] = field.Deposit(at[0], at[1], amounts.data()[i]);
  });
}

/// Rows, columns, and the width and the height of a cell.
std::tuple<size_t, size_t, double, double> GridOf(const ModelHandle& handle) {
  return handle.With([](Model& model) {
    const ModelField& field = AsField(model);
    return std::tuple(field.rows(), field.columns(), field.CellWidth(), field.CellHeight());
  });
}

/// X, y and heading of its middle in the world.
std::tuple<double, double, double> FrameOf(const ModelHandle& handle) {
  return handle.With([](Model& model) {
    const Pose frame = AsField(model).GetGlobalPose() + model.GetGeom().pose;
    return std::tuple(frame.x, frame.y, frame.a);
  });
}

/// Diffusion and evaporation.
std::tuple<double, double> RatesOf(const ModelHandle& handle) {
  return handle.With([](Model& model) {
    const ModelField& field = AsField(model);
    return std::tuple(field.diffusion(), field.evaporation());
  });
}

void SetRates(const ModelHandle& handle, double diffusion, double evaporation) {
  handle.With([&](Model& model) {
    ModelField& field = AsField(model);
    if (!field.SetDiffusion(diffusion) || !field.SetEvaporation(evaporation))
      throw nb::value_error("found a rate that is negative or not finite");
  });
}

std::vector<ModelHandle> FieldsOf(const std::shared_ptr<Simulation>& simulation) {
  return simulation->With([&](World& world) {
    std::vector<ModelHandle> fields;
    for (const ModelField* field : world.host().fields) fields.emplace_back(simulation, *field);
    return fields;
  });
}

}  // namespace

void BindField(nb::module_& module, nb::class_<Simulation>& world) {
  module.def("field_grid", &GridOf, nb::arg("model"))
      .def("field_frame", &FrameOf, nb::arg("model"))
      .def("field_rates", &RatesOf, nb::arg("model"))
      .def("set_field_rates", &SetRates, nb::arg("model"), nb::arg("diffusion"),
           nb::arg("evaporation"))
      .def("field_integral",
           [](const ModelHandle& handle) {
             return handle.With([](Model& model) { return AsField(model).Integral(); });
           })
      .def("copy_field_values", &CopyValues, nb::arg("model"), nb::arg("to"))
      .def("set_field_values", &SetFieldValues, nb::arg("model"), nb::arg("values"))
      .def("read_field", &ReadPlaces, nb::arg("model"), nb::arg("places"), nb::arg("linear"),
           nb::arg("to"))
      .def("deposit_in_field", &DepositAll, nb::arg("model"), nb::arg("places"), nb::arg("amounts"),
           nb::arg("done"));
  world.def("fields", &FieldsOf);
}

}  // namespace Stg::python
