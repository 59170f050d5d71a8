// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model types: descriptions of model classes, each in one place. Part of <stage.hh>; C++11.
//
//   static const bool registered =
//       Stg::RegisterModelType(Stg::ModelTypeOf<Sonar>("sonar").Senses(DescribeSonar));
//
// beside a class registers it as soon as its library is loaded. See the plug-in in examples/model.

#ifndef STAGE_MODELS_MODEL_TYPE_HH
#define STAGE_MODELS_MODEL_TYPE_HH

#include <stddef.h>
#include <stdint.h>

#include <functional>
#include <string>
#include <typeinfo>
#include <vector>

#include "models/model.hh"
#include "models/readings.hh"

namespace Stg {

/// Amount of data that a sensor processes in one update.
struct SensorExtent {
  size_t parts = 1;        ///< sensors of a ranger, lines of a bumper, beams of a gripper
  uint64_t rays = 0;       ///< sum over all parts
  bool rays_vary = false;  ///< unknown in advance: `rays` is 0
  uint64_t pixels = 0;     ///< of a camera's picture
};

struct ModelType {
  /// How updates of exactly this class may run. All values except kSerial promise that Update()
  /// does no more than Model::Update() and Model::Gather(), so that several models may update at
  /// once.
  enum Updates : unsigned {
    kSerial = 0,               ///< one at a time, with nothing else running
    kParallel = 1,             ///< several models at once
    kIgnoresOwnTree = 2,       ///< its rays ignore its own tree
    kReadsFiducialIndex = 4,   ///< it reads the index of fiducials
    kUsesEverythingLayer = 8,  ///< its rays use the layer of all heights
    kRequestsSensed = 16,      ///< it requests Sensed()
    kReadsContacts = 64,       ///< it calls ForEachContact()
    kReadsLightIndex = 128,    ///< it reads the index of lights
    kCallsVelocity = 32,       ///< it calls CB_VELOCITY callbacks; runs alone if there are any
  };
  [[deprecated("use kSerial")]] static const Updates kAlone = kSerial;
  [[deprecated("use kParallel")]] static const Updates kShared = kParallel;
  [[deprecated("use kIgnoresOwnTree")]] static const Updates kPastOwnTree = kIgnoresOwnTree;
  [[deprecated("use kReadsFiducialIndex")]] static const Updates kLooksForFiducials =
      kReadsFiducialIndex;
  [[deprecated("use kUsesEverythingLayer")]] static const Updates kThroughAllHeights =
      kUsesEverythingLayer;
  [[deprecated("use kRequestsSensed")]] static const Updates kHasRest = kRequestsSensed;
  /// How models of exactly this class take part in the move phase.
  enum Moves : unsigned {
    kMovesByItself,  ///< by Move(), one after the other
    kMovesTree,      ///< by GetWantedMove() and EndMove(), several models at once
    kStays,          ///< never
  };
  std::string name;          ///< as in world files
  const std::type_info* of;  ///< the class
  size_t size;               ///< of an object, in bytes
  creator_t create;
  bool (*is)(const Model&);  ///< whether a model is of the class or a derived one
  unsigned updates;          ///< combination of Updates
  Moves moves;
  /// Describes a sensor's extent; empty if it is no sensor.
  std::function<void(const Model&, SensorExtent*)> describe;
  /// True if ExchangeState() covers all that updates change, so that they can be measured and
  /// undone (MeasureStepCosts()).
  bool measurable;
  /// Readings of a sensor. A derived type without any has those of its base.
  std::vector<Reading> readings;
};

/// Builder of a ModelType. M needs a constructor M(World*, Model* parent, const std::string& type).
template <class M>
class ModelTypeOf {
 public:
  explicit ModelTypeOf(const std::string& name) {
    type_.name = name;
    type_.of = &typeid(M);
    type_.size = sizeof(M);
    type_.create = Create;
    type_.is = Is;
    type_.updates = ModelType::kSerial;
    type_.moves = ModelType::kMovesByItself;
    type_.measurable = false;
  }

  ModelTypeOf& Updates(unsigned how) {
    type_.updates = how;
    return *this;
  }
  ModelTypeOf& Moves(ModelType::Moves how) {
    type_.moves = how;
    return *this;
  }
  ModelTypeOf& Senses(void (*describe)(const M&, SensorExtent*)) {
    type_.describe = [describe](const Model& model, SensorExtent* extent) {
      describe(static_cast<const M&>(model), extent);
    };
    return *this;
  }
  ModelTypeOf& Measurable() {
    type_.measurable = true;
    return *this;
  }

  /// Adds a reading: see models/readings.hh.
  ModelTypeOf& Reads(const Reading& reading) {
    type_.readings.push_back(reading);
    return *this;
  }

  operator const ModelType&() const { return type_; }

 private:
  static Model* Create(World* world, Model* parent, const std::string& type) {
    return new M(world, parent, type);
  }
  static bool Is(const Model& model) { return dynamic_cast<const M*>(&model) != NULL; }

  ModelType type_;
};

/// Registers a type for the lifetime of the process. Can be called at any time from any thread.
/// Returns false with a message if the name is taken.
bool RegisterModelType(const ModelType& type);

/// Returns the first type registered for exactly the model's class, or null.
const ModelType* FindModelType(const Model& model);
/// Like FindModelType(), but also accepts base classes other than Model.
const ModelType* FindNearestModelType(const Model& model);
/// Returns the nearest type with readings among the model's type and its bases, or null.
const ModelType* FindSensorType(const Model& model);
/// All types with readings, in the order of registration.
std::vector<const ModelType*> SensorTypes();

}  // namespace Stg

#endif
