// SPDX-License-Identifier: GPL-2.0-or-later
//
// Flags: coloured tokens that models carry and pass on. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_FLAG_HH
#define STAGE_MODELS_FLAG_HH

#include "models/model.hh"
#include "pictures/color.hh"

class GLUquadric;

namespace Stg {

class Model::Flag {
 public:
  /// `size` is the diameter in metres.
  Flag(const Color& color, double size) : color_(color), size_(size) {}

  void SetColor(const Color& c) { color_ = c; }
  void SetSize(double size) { size_ = size; }
  Color GetColor() { return color_; }
  double GetSize() { return size_; }

  /// Splits off a flag of the same colour with size `portion`, or what remains; null if nothing
  /// does. The caller owns it.
  Flag* Nibble(double portion);

  /// The library has no window, so this draws nothing.
  void Draw(GLUquadric*) {}

 private:
  Color color_;
  double size_;
};

}  // namespace Stg

#endif
