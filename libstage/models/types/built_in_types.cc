// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/built_in_types.hh"

#include "models/model_type_list.hh"

namespace Stg {

std::vector<ModelType> BuiltInModelTypes() {
  return {ModelTypeOf<Model>("model").Updates(ModelType::kParallel).Moves(ModelType::kStays),
          ActuatorType(),
          BlinkenlightType(),
          BlobfinderType(),
          BumperType(),
          CameraType(),
          FiducialType(),
          FieldType(),
          GripperType(),
          GroundSensorType(),
          LightType(),
          LightIndicatorType(),
          LightSensorType(),
          PositionType(),
          RadioType(),
          RangerType(),
          WifiType()};
}

}  // namespace Stg
