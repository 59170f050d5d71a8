// SPDX-License-Identifier: GPL-2.0-or-later
//
// WorldBase: the part of World that its models use. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_WORLD_BASE_HH
#define STAGE_MODELS_WORLD_BASE_HH

#include <cstdint>

#include "geometry/geometry.hh"
#include "models/ancestor.hh"
#include "pictures/color.hh"
#include "random/random.hh"

namespace Stg {

class Host;
class Option;
class Visualizer;

/// Base of World. Models refer to their world through it, so that module `models` does not depend
/// on module `world`.
class WorldBase : public Ancestor {
 public:
  usec_t SimTimeNow(void) const { return sim_time; }
  usec_t sim_interval;  ///< length of a step
  Model* GetGround() { return ground; }
  Model* ground;
  virtual uint64_t seed() const = 0;
  /// Generator of the world's own random numbers; see also Model::random().
  RandomStream& random() { return random_.Get(); }

  virtual void AddModel(Model* mod) = 0;
  virtual void RemoveModel(Model* mod) = 0;
  Host& host() { return *host_; }

  // The following functions have no effect without a window.

  virtual bool IsGUI() const { return false; }
  virtual void Redraw(void) {}
  /// The next picture must be drawn completely.
  void NeedRedraw() { dirty = true; }
  virtual void PushColor(Color) {}
  virtual void PushColor(double, double, double, double) {}
  virtual void PopColor() {}
  /// Does not take ownership.
  virtual void RegisterOption(Option* option) = 0;
  /// Called when a model gets a visualizer; windows create an option for it.
  virtual void OfferVisualizer(Visualizer*, bool) {}

 protected:
  explicit WorldBase(uint64_t seed)
      : sim_interval(0), ground(NULL), sim_time(0), dirty(false), host_(NULL), random_(seed) {}

  usec_t sim_time;
  bool dirty;
  Host* host_;  // set by World
  LazyRandomStream random_;
};

}  // namespace Stg

#endif
