// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rasterizes glyphs with FreeType; fontconfig finds the font file. Needs neither a display nor
// OpenGL.

#ifndef STAGE_GUI_DRAW_FONT_HH
#define STAGE_GUI_DRAW_FONT_HH

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gui/draw/primitives.hh"

namespace Stg::draw {

/// A glyph corner: canvas pixels from the lower left corner, atlas coordinates in 0..1. 20 bytes.
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

  /// Loads a sans-serif font of this size. Returns false and a one-line reason if there is none;
  /// text is then left out.
  bool Open(int pixels, std::string* error);
  bool is_open() const { return impl_ != nullptr; }

  double height() const { return height_; }    ///< line spacing, pixels
  double descent() const { return descent_; }  ///< depth below the baseline, pixels
  double Width(std::string_view utf8);
  /// Appends two triangles for each glyph. The baseline starts at (x, y).
  void Append(std::string_view utf8, double x, double y, const Rgba& color,
              std::vector<TextVertex>* vertices);

  /// Opacities of kAtlasSide x kAtlasSide pixels, top row first.
  const std::vector<uint8_t>& atlas() const { return atlas_; }
  /// Changes whenever glyphs are added to the atlas.
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
