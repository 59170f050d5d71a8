// SPDX-License-Identifier: GPL-2.0-or-later
//
// Names of topics and frames, and covariances of exact and unknown values, for the ROS node. They
// are those of logs.

#include <nanobind/stl/vector.h>

#include <set>

#include "bindings.hh"
#include "recording/odometry_covariance.hh"
#include "recording/ros_names.hh"
#include "text.hh"

namespace Stg::python {

using recording::NamingScheme;

void BindRosNames(nanobind::module_& module) {
  namespace nb = nanobind;
  module.attr("SCAN_TOPIC") = recording::kScanTopic;
  module.attr("ODOMETRY_TOPIC") = recording::kOdometryTopic;
  module.attr("MAP_FRAME") = recording::kMapFrame;
  module.attr("ODOMETRY_FRAME") = recording::kOdometryFrame;
  module.attr("FOOTPRINT_FRAME") = recording::kFootprintFrame;
  module.attr("BASE_FRAME") = recording::kBaseFrame;
  module.attr("EXACT_COVARIANCE") = recording::OdometryCovariance::kExact;
  module.attr("UNKNOWN_COVARIANCE") = recording::OdometryCovariance::kUnknown;
  nb::class_<NamingScheme>(module, "NamingScheme", "A scheme of names in ROS.")
      .def_ro("name", &NamingScheme::name)
      .def_ro("ground_truth", &NamingScheme::ground_truth, "Topic of the true pose.")
      .def_ro("scan_frame", &NamingScheme::scan_frame, "Frame of a ranger, without a number.")
      .def_ro("camera_frame", &NamingScheme::camera_frame)
      .def("numbered", &NamingScheme::Numbered, nb::arg("base"), nb::arg("number"),
           nb::arg("count"),
           "The name of thing `number` of `count` of one kind; without a number if it is the only "
           "one.")
      .def(
          "prefixes",
          [](const NamingScheme& scheme, const std::vector<std::string>& robots, bool always) {
            std::set<std::string> taken;
            return scheme.Prefixes(robots, always, &taken);
          },
          nb::arg("robots"), nb::arg("always"),
          "Prefixes of each robot's topics and frames. A single robot has an empty one, unless "
          "`always`.");
  module.def("naming_schemes", &recording::NamingSchemes);
  module.def("ros_name", &recording::RosName, nb::arg("token"),
             "Reduces a name to letters, digits and single underscores that do not start with a "
             "digit.");
  module.def("sensor_name", &recording::SensorName, nb::arg("ranger"), nb::arg("number"),
             "The name of a sensor of a ranger; the first one has the name of the ranger.");
  module.def("joined", &recording::Joined, nb::arg("prefix"), nb::arg("name"),
             "Returns prefix/name, or only the name if the prefix is empty.");
}

}  // namespace Stg::python
