// SPDX-License-Identifier: GPL-2.0-or-later
//
// The built-in model types, each defined beside its class.

#ifndef STAGE_MODELS_TYPES_BUILT_IN_TYPES_HH
#define STAGE_MODELS_TYPES_BUILT_IN_TYPES_HH

#include "models/model_type.hh"

namespace Stg {

ModelType ActuatorType();
ModelType BlinkenlightType();
ModelType BlobfinderType();
ModelType BumperType();
ModelType CameraType();
ModelType FiducialType();
ModelType FieldType();
ModelType GripperType();
ModelType GroundSensorType();
ModelType LightIndicatorType();
ModelType LightSensorType();
ModelType LightType();
ModelType PositionType();
ModelType RadioType();
ModelType RangerType();
ModelType WifiType();

}  // namespace Stg

#endif
