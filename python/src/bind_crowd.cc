// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings.hh"
#include "crowd.hh"

namespace Stg::python {

void BindCrowd(nb::module_& module) {
  nb::class_<Crowd>(module, "Crowd",
                    "Arrays of the robots of one or several worlds; see stagesim.Fleet.")
      .def_prop_ro("size", &Crowd::size)
      .def("pose", &Crowd::PoseArray)
      .def("velocity", &Crowd::VelocityArray)
      .def("stalled", &Crowd::StalledArray)
      .def("energy", &Crowd::EnergyArray)
      .def("commands", &Crowd::CommandArray)
      .def("ranger", &Crowd::RangerArray, nb::arg("index"), nb::arg("what"))
      .def("fiducials", &Crowd::FiducialArray, nb::arg("index"), nb::arg("most"), nb::arg("what"))
      .def("blobs", &Crowd::BlobArray, nb::arg("index"), nb::arg("most"), nb::arg("what"))
      .def("bumper", &Crowd::BumperArray, nb::arg("index"));
}

}  // namespace Stg::python
