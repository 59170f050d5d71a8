// SPDX-License-Identifier: GPL-2.0-or-later
//
// Letters as pictures, by FreeType; the file comes from fontconfig. Works with and without a
// display. No OpenGL here.

#ifndef STAGE_GUI_DRAW_FONT_HH
#define STAGE_GUI_DRAW_FONT_HH

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gui/draw/primitives.hh"

namespace Stg::draw {

/// A corner of a letter: pixels of the canvas from its lower left corner, and where the letter is
/// in the atlas, 0..1. 20 bytes.
struct TextVertex {
  float x, y, u, v;
  Rgba color;
};
static_assert(sizeof(TextVertex) == 20);

class Font {
 public:
  static constexpr int kAtlasSide = 512;

  Font();
  ~Font();
  Font(const Font&) = delete;
  Font& operator=(const Font&) = delete;

  /// A sans-serif font of that size. False and a line that says why; texts are then left out.
  bool Open(int pixels, std::string* error);
  bool is_open() const { return impl_ != nullptr; }

  double height() const { return height_; }    ///< from one line to the next
  double descent() const { return descent_; }  ///< below the base line
  double Width(std::string_view utf8);
  /// Two triangles for each letter; the base line begins at (x, y).
  void Append(std::string_view utf8, double x, double y, const Rgba& color,
              std::vector<TextVertex>* vertices);

  /// kAtlasSide * kAtlasSide opacities, the first row first.
  const std::vector<uint8_t>& atlas() const { return atlas_; }
  /// Changes when letters were added to the atlas.
  unsigned atlas_version() const { return atlas_version_; }

 private:
  struct Impl;
  struct Glyph {
    float advance = 0;
    float left = 0, bottom = 0, width = 0, height = 0;  // pixels
    float u = 0, v = 0;                                 // pixels of the atlas
  };
  const Glyph& Find(uint32_t code);
  Glyph Render(uint32_t code);

  std::unique_ptr<Impl> impl_;
  double height_ = 0, descent_ = 0;
  std::vector<uint8_t> atlas_;
  unsigned atlas_version_ = 0;
  int next_x_ = 1, next_y_ = 1, row_height_ = 0;
};

}  // namespace Stg::draw

#endif
