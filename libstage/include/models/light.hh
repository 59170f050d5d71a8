// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelLight: a lamp in the world, or an LED on a robot. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_LIGHT_HH
#define STAGE_MODELS_LIGHT_HH

#include "models/model.hh"

namespace Stg {

class LightIndex;

/// A model that light sensors sense while it is on and its intensity is not 0. It shines equally in
/// all directions.
class LightSource {
 public:
  LightSource(const LightSource&) = delete;
  LightSource& operator=(const LightSource&) = delete;

  virtual bool IsOn() const = 0;
  /// Irradiance that the light causes at a distance of 1 m, on a surface that faces it, W/m2.
  double GetIntensity() const { return intensity_; }
  /// The model that is the light.
  const Model& model() const { return *model_; }

 protected:
  /// Registers the light in its model's world.
  LightSource(Model* model, double intensity);
  virtual ~LightSource();
  /// Reads the property `intensity`.
  void LoadIntensity(Worldfile* wf, int entity);

  double intensity_;

 private:
  Model* const model_;
};

/// A lamp or an LED. It is no obstacle, and rangers do not see it, unless the world file says so.
/// Blobfinders and cameras see it.
class ModelLight : public Model, public LightSource {
 public:
  ModelLight(World* world, Model* parent, const std::string& type);

  /// A change counts from the next instant on at which a sensor senses.
  void SetOn(bool on) { is_on_ = on; }
  bool IsOn() const override { return is_on_; }
  /// W/m2 at 1 m. Refused with a message if it is negative or not finite.
  void SetIntensity(double intensity);
  /// Its colour, at half the brightness while it is off.
  Color GetShownColor() const override;

  using Model::Load;
  void Load() override;
  void ExchangeState(StateExchange& exchange) override;

 private:
  bool is_on_;
};

}  // namespace Stg

#endif
