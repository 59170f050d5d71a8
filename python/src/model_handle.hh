// SPDX-License-Identifier: GPL-2.0-or-later
//
// The Python class Model. It refers to a model by id, so that the model may be deleted at any time.

#ifndef STAGE_PYTHON_MODEL_HANDLE_HH
#define STAGE_PYTHON_MODEL_HANDLE_HH

#include <memory>

#include "simulation.hh"

namespace Stg::python {

class ModelHandle {
 public:
  ModelHandle(std::shared_ptr<Simulation> simulation, const Model& model)
      : simulation_(std::move(simulation)), key_(simulation_->KeyOf(model)) {}

  /// Calls f(model) while nobody else uses the world. Throws Failure if the model is gone.
  template <typename F>
  auto With(F f) const {
    return simulation_->With([&](World&) { return f(Get()); });
  }
  /// Calls f(model), which may change the world, and then updates the arrays of its crowds.
  template <typename F>
  auto Change(F f) const {
    return simulation_->With([&](World&) {
      f(Get());
      simulation_->Refresh();
    });
  }
  bool exists() const {
    const Source::Use use(simulation_.get());
    return simulation_->Find(0, key_) != nullptr;
  }
  bool operator==(const ModelHandle& o) const {
    return simulation_ == o.simulation_ && key_.id == o.key_.id;
  }
  uint32_t id() const { return key_.id; }
  const ModelKey& key() const { return key_; }
  const std::shared_ptr<Simulation>& simulation() const { return simulation_; }

 private:
  Model& Get() const {
    Model* const model = simulation_->Find(0, key_);
    if (!model)
      throw Failure{Kind::kGone, "the model number " + std::to_string(key_.id) + " is gone"};
    return *model;
  }

  std::shared_ptr<Simulation> simulation_;
  ModelKey key_;
};

/// A getter that returns get(model).
template <typename Get>
auto Getter(Get get) {
  return [get](const ModelHandle& handle) { return handle.With(get); };
}

/// Throws nb::type_error, which names the type of the model and the expected type.
[[noreturn]] inline void RefuseType(const Model& model, const char* expected) {
  throw nb::type_error(
      ("found a model of the type " + model.GetModelType() + ", expected a " + expected).c_str());
}

/// Casts the model to T. Throws nb::type_error, naming the type `type`, if it is no T.
template <typename T>
T& As(Model& model, const char* type) {
  if (T* const found = dynamic_cast<T*>(&model)) return *found;
  RefuseType(model, type);
}

}  // namespace Stg::python

#endif
