// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lays out everything that is drawn in pixels: text at points of the world, speech bubbles, boxes
// with text, charts. Collects triangles; no OpenGL here.

#ifndef STAGE_GUI_DRAW_SCREEN_WRITER_HH
#define STAGE_GUI_DRAW_SCREEN_WRITER_HH

#include <string>
#include <vector>

#include "gui/draw/font.hh"
#include "gui/draw/render_scene.hh"

namespace Stg::draw {

/// Where a paragraph goes, in pixels of the frame.
struct TextBox {
  Bounds x, y;
  Align across = Align::kCentre;
  Align up = Align::kCentre;  ///< kLeft: at the bottom; kRight: at the top
  bool wrap = false;          ///< break lines that are longer than the box
};

class ScreenWriter {
 public:
  explicit ScreenWriter(Font* font) : font_(*font) {}

  void Clear() { vertices_.clear(); }
  const std::vector<TextVertex>& vertices() const { return vertices_; }

  /// Adds the painting's labels whose points are visible.
  void AddLabels(const Painting& painting, const view::Projection& projection);
  /// Adds labels like AddLabels(), but skips those that would overlap others.
  void AddAxisNumbers(const Painting& painting, const view::Projection& projection);
  void AddText(std::string_view text, double x, double y, const Rgba& color,
               Align align = Align::kLeft);
  /// Adds text of several lines. Text that does not fit overflows the box.
  void AddParagraph(std::string_view text, const TextBox& box, const Rgba& color);
  /// The clock's box in the lower left corner.
  void AddClock(const std::string& text);
  /// A translucent box with lines of text in the upper left corner.
  void AddOverlay(const std::vector<std::string>& lines, int canvas_height);
  void AddChart(const Chart& chart);

 private:
  void AddTriangle(double ax, double ay, double bx, double by, double cx, double cy,
                   const Rgba& color);
  /// Adds a line of one pixel's width.
  void AddLine(double ax, double ay, double bx, double by, const Rgba& color);
  void AddBox(double x, double y, double width, double height, const Rgba& color);
  /// Adds a rectangle with a margin around it and cut corners.
  void AddOctagon(double x, double y, double width, double height, double margin,
                  const Rgba& color);
  void AddHaloedText(std::string_view text, double x, double y, const Rgba& color);
  void AddBubble(std::string_view text, double x, double y);

  std::vector<std::string_view> BreakLines(std::string_view text, double width);

  Font& font_;
  std::vector<TextVertex> vertices_;
};

}  // namespace Stg::draw

#endif
