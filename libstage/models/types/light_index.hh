// SPDX-License-Identifier: GPL-2.0-or-later
//
// The lights of a world, and a spatial index of those that are on, so that each light sensor
// examines only nearby ones.

#ifndef STAGE_MODELS_TYPES_LIGHT_INDEX_HH
#define STAGE_MODELS_TYPES_LIGHT_INDEX_HH

#include <cstdint>
#include <vector>

#include "geometry/geometry.hh"
#include "messages/assert.hh"
#include "models/types/place_index.hh"

namespace Stg {

class LightSource;
class Model;

class LightIndex {
 public:
  /// A light that is on.
  struct Light {
    const Model* root;        ///< of its tree
    point_t place;            ///< centre of its body, global
    double intensity;         ///< W/m2 at 1 m
    double red, green, blue;  ///< its colour, each 0 to 1
  };

  void Add(LightSource* light);
  void Remove(const LightSource* light);
  /// All lights of the world, on or not, in the order of creation.
  const std::vector<LightSource*>& sources() const { return sources_; }

  /// Reads the lights. Call it before sensors look for lights. While the index is frozen, only the
  /// first call reads them.
  void Refresh();
  /// Freeze the index only while no code runs that may move, switch or delete lights.
  void SetFrozen(bool frozen) {
    frozen_ = frozen;
    is_current_ = false;
  }

  /// Returns the lights whose x and y lie within +-reach of the point, in the order of creation.
  /// Valid until this thread's next call.
  const std::vector<uint32_t>& Near(double x, double y, double reach) const {
    STAGE_ASSERT(is_current_ && places_.size() == lights_.size());  // after Refresh()
    return places_.Near(x, y, reach);
  }
  const Light& light(uint32_t i) const {
    STAGE_ASSERT(is_current_ && i < lights_.size());
    return lights_[i];
  }

 private:
  std::vector<LightSource*> sources_;
  std::vector<Light> lights_;    // in the order of creation
  std::vector<point_t> points_;  // scratch memory of Refresh()
  PlaceIndex places_;            // of `lights_`
  bool frozen_ = false;
  bool is_current_ = false;  // Refresh() has read the lights since SetFrozen()
};

}  // namespace Stg

#endif
