// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the arrays of a batch get their elements from the columns of rows on a device.

#ifndef STAGE_PYTHON_DEVICE_PLAN_HH
#define STAGE_PYTHON_DEVICE_PLAN_HH

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "models/model_type.hh"
#include "row_crowd.hh"
#include "rows/row_backend.hh"

namespace Stg::python {

/// The contents of an array. Elements without an entry keep the value that they have in `fill`.
struct DevicePlan {
  std::vector<size_t> shape;  ///< of a world's part of the array
  std::vector<rows::RowPart> parts;
  std::vector<double> fill;     ///< by element of a world; flags are 0 or 1
  std::vector<uint32_t> needs;  ///< ids of models that must run, but do not yet

  /// Elements of a world.
  size_t Count() const {
    size_t count = 1;
    for (const size_t length : shape) count *= length;
    return count;
  }
};

/// Plans the array "pose" or the like. Throws Failure if devices do not have it.
DevicePlan PlanBody(const std::string& name, const RowRobots& robots);
DevicePlan PlanStalled(const RowRobots& robots);
DevicePlan PlanTime(const RowRobots& robots);
DevicePlan PlanEnded(const RowRobots& robots);
DevicePlan PlanCommands(const RowRobots& robots);
/// Plans the array of a reading, or of "time", of sensor number `index` of a type of each robot.
/// Throws Failure if there is none, or if devices do not have it.
DevicePlan PlanReading(const ModelType& type, size_t index, const std::string& name,
                       const RowRobots& robots);

}  // namespace Stg::python

#endif
