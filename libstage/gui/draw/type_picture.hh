// SPDX-License-Identifier: GPL-2.0-or-later
//
// Registry of functions that draw the data of model types. Each type registers in types/NAME.cc:
//
//   [[maybe_unused]] const bool kRegistered =
//       RegisterPicture(PictureOf<ModelSonar>({{"Sonar cones", "show_sonar", true}}, DrawSonar));

#ifndef STAGE_GUI_DRAW_TYPE_PICTURE_HH
#define STAGE_GUI_DRAW_TYPE_PICTURE_HH

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "gui/draw/model_pictures.hh"
#include "gui/view/type_switches.hh"
#include "models/model.hh"

namespace Stg::draw {

inline constexpr double kMaxDrawnLength = 1e5;  ///< drawing limit for infinite lengths, metres
inline double Finite(double length) {
  return std::isfinite(length) ? std::min(length, kMaxDrawnLength) : kMaxDrawnLength;
}

/// Inputs for drawing data in one frame.
struct DataFrame {
  const view::ViewOptions& options;
  const view::Projection& projection;
  const Layers& layers;
};

struct TypePicture {
  view::TypeSwitches switches;
  /// Draws the sensed data of a model of this type that has subscribers. `global` is its pose.
  /// Empty if there is nothing to draw, or if the scene draws it elsewhere.
  std::function<void(Model& model, const Pose& global, const DataFrame& frame)> draw;
};

/// Makes the entry for the class M and classes derived from it.
template <class M>
TypePicture PictureOf(std::vector<view::TypeSwitch> switches,
                      void (*draw)(M&, const Pose&, const DataFrame&) = nullptr) {
  TypePicture picture;
  picture.switches.is = [](const Model& model) {
    return dynamic_cast<const M*>(&model) != nullptr;
  };
  picture.switches.switches = std::move(switches);
  if (draw)
    picture.draw = [draw](Model& model, const Pose& global, const DataFrame& frame) {
      draw(dynamic_cast<M&>(model), global, frame);
    };
  return picture;
}

/// Call during static initialization, while libraries are loaded.
bool RegisterPicture(const TypePicture& picture);
/// Returns null if the model's type has no entry.
const TypePicture* FindPicture(const Model& model);

}  // namespace Stg::draw

#endif
