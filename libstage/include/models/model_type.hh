// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model types: what is known of a class of models beside the class itself, in one place for each.
// Part of <stage.hh>; C++11.
//
//   static const bool registered =
//       Stg::RegisterModelType(Stg::ModelTypeOf<Sonar>("sonar").Senses(DescribeSonar));
//
// beside a class makes it known, as soon as its library is loaded. examples/model is a plug-in with
// a type of its own.

#ifndef STAGE_MODELS_MODEL_TYPE_HH
#define STAGE_MODELS_MODEL_TYPE_HH

#include <stddef.h>
#include <stdint.h>

#include <functional>
#include <string>
#include <typeinfo>

#include "models/model.hh"

namespace Stg {

/// How much a sensor looks at in one update.
struct SensorExtent {
  size_t parts = 1;        ///< a ranger's sensors, a bumper's lines, a gripper's beams
  uint64_t rays = 0;       ///< all of them together
  bool rays_vary = false;  ///< it is not known before how many: `rays` is 0
  uint64_t pixels = 0;     ///< of a camera's picture
};

struct ModelType {
  /// How the updates of the very class may be made. All but kAlone promise that Update() does what
  /// Model::Update() and Model::Gather() do and no more, so that several models may update at once.
  enum Updates : unsigned {
    kAlone = 0,              ///< in their turn, with nothing else going on
    kShared = 1,             ///< several models at once
    kPastOwnTree = 2,        ///< and its rays pass its own tree
    kLooksForFiducials = 4,  ///< and it looks at those that fiducial finders may see
    kThroughAllHeights = 8,  ///< and its rays go through the layer of all heights
    kHasRest = 16,           ///< and it asks for Sensed()
    kCallsVelocity = 32,     ///< and it calls callbacks of CB_VELOCITY; alone, if there are any
  };
  std::string name;          ///< as in world files
  const std::type_info* of;  ///< the class
  size_t size;               ///< of an object, bytes
  creator_t create;
  bool (*is)(const Model&);  ///< of the class, or of one derived from it
  unsigned updates;          ///< of Updates
  /// Empty: it senses nothing.
  std::function<void(const Model&, SensorExtent*)> describe;
  /// Its ExchangeState() lists all that updates change, so that they can be measured, and put back
  /// (World::MeasureStepCosts()).
  bool measurable;
};

/// A type in the making. The class M has a constructor for (World*, Model* parent, const
/// std::string& type).
template <class M>
class ModelTypeOf {
 public:
  explicit ModelTypeOf(const std::string& name) {
    type_.name = name;
    type_.of = &typeid(M);
    type_.size = sizeof(M);
    type_.create = Create;
    type_.is = Is;
    type_.updates = ModelType::kAlone;
    type_.measurable = false;
  }

  ModelTypeOf& Updates(unsigned how) {
    type_.updates = how;
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

  operator const ModelType&() const { return type_; }

 private:
  static Model* Create(World* world, Model* parent, const std::string& type) {
    return new M(world, parent, type);
  }
  static bool Is(const Model& model) { return dynamic_cast<const M*>(&model) != NULL; }

  ModelType type_;
};

/// Makes a type known for as long as the process lives; at any time, from any thread. False, after
/// a message, if there is one of that name already.
bool RegisterModelType(const ModelType& type);

/// That of the model's very class, the first one if it has several; null if it has none.
const ModelType* FindModelType(const Model& model);
/// The same, or else that of a class that it is derived from; null if that is Model alone.
const ModelType* FindNearestModelType(const Model& model);

}  // namespace Stg

#endif
