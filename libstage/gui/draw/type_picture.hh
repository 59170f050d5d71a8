// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the data of a model type look: a registration in types/NAME.cc for each type that has any.
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

inline constexpr double kFarthest = 1e5;  ///< m; what is infinite is drawn to there
inline double Finite(double length) {
  return std::isfinite(length) ? std::min(length, kFarthest) : kFarthest;
}
/// As long as that, about 0.
inline Bounds Half(double size) { return Bounds(-size / 2, size / 2); }

/// What is drawn with, in one picture.
struct DataFrame {
  const view::ViewOptions& options;
  const view::Projection& projection;
  const Layers& layers;
};

struct TypePicture {
  view::TypeSwitches switches;
  /// Draws what the model, of the type and with a subscriber, has sensed. `global`: where it is.
  /// Empty: nothing, or another part of the scene does.
  std::function<void(Model& model, const Pose& global, const DataFrame& frame)> draw;
};

/// The picture of the class M and of those derived from it.
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

/// To be called while libraries are loaded.
bool RegisterPicture(const TypePicture& picture);
/// Null if its type has none.
const TypePicture* FindPicture(const Model& model);

}  // namespace Stg::draw

#endif
