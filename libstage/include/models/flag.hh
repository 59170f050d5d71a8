// SPDX-License-Identifier: GPL-2.0-or-later
//
// Flags: coloured tokens that models carry and hand on. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_FLAG_HH
#define STAGE_MODELS_FLAG_HH

#include "geometry/color.hh"
#include "models/model.hh"

class GLUquadric;

namespace Stg {

class Model::Flag {
 public:
  /// `size`: its diameter, metres.
  Flag(const Color& color, double size) : color_(color), size_(size) {}

  void SetColor(const Color& c) { color_ = c; }
  void SetSize(double size) { size_ = size; }
  Color GetColor() { return color_; }
  double GetSize() { return size_; }

  /// A new flag of the same colour that takes `portion` of the size, or what is left of it; null if
  /// nothing is. It belongs to the caller.
  Flag* Nibble(double portion);

  /// Of a library without a window: draws nothing.
  void Draw(GLUquadric*) {}

 private:
  Color color_;
  double size_;
};

}  // namespace Stg

#endif
