// SPDX-License-Identifier: GPL-2.0-or-later
//
// What is drawn in pixels: texts at points of the world, speech bubbles, boxes with texts, charts.
// Collects triangles; no OpenGL here.

#ifndef STAGE_GUI_DRAW_SCREEN_WRITER_HH
#define STAGE_GUI_DRAW_SCREEN_WRITER_HH

#include <string>
#include <vector>

#include "gui/draw/font.hh"
#include "gui/draw/scene.hh"

namespace Stg::draw {

class ScreenWriter {
 public:
  explicit ScreenWriter(Font* font) : font_(*font) {}

  void Clear() { vertices_.clear(); }
  const std::vector<TextVertex>& vertices() const { return vertices_; }

  /// The labels of a painting, where their points are seen.
  void AddLabels(const Painting& painting, const view::Projection& projection);
  void AddText(std::string_view text, double x, double y, const Rgba& color,
               Align align = Align::kLeft);
  /// The clock's box in the lower left corner.
  void AddClock(const std::string& text);
  /// A translucent box with lines of text in the upper left corner.
  void AddOverlay(const std::vector<std::string>& lines, int canvas_height);
  void AddChart(const Chart& chart);

 private:
  void AddTriangle(double ax, double ay, double bx, double by, double cx, double cy,
                   const Rgba& color);
  void AddBox(double x, double y, double width, double height, const Rgba& color);
  /// A rectangle with a margin around it whose corners are cut.
  void AddOctagon(double x, double y, double width, double height, double margin,
                  const Rgba& color);
  void AddBubble(std::string_view text, double x, double y);

  Font& font_;
  std::vector<TextVertex> vertices_;
};

}  // namespace Stg::draw

#endif
