// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/screen_writer.hh"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace Stg::draw {

namespace {

constexpr double kMargin = 5;           // pixels around texts in boxes
constexpr double kMinClockWidth = 200;  // pixels
constexpr Rgba kPaleBlue = {204, 204, 255, 255}, kPink = {255, 204, 204, 255};
constexpr Rgba kGlass = {255, 255, 255, 215};

/// Fraction of the text's width that lies before its anchor.
double FractionOf(Align align) {
  return align == Align::kLeft ? 0 : align == Align::kCentre ? 0.5 : 1;
}

}  // namespace

void ScreenWriter::AddTriangle(double ax, double ay, double bx, double by, double cx, double cy,
                               const Rgba& color) {
  for (const auto& [x, y] : {std::pair{ax, ay}, std::pair{bx, by}, std::pair{cx, cy}})
    vertices_.push_back({static_cast<float>(x), static_cast<float>(y), -1, -1, color});
}

void ScreenWriter::AddLine(double ax, double ay, double bx, double by, const Rgba& color) {
  const double length = std::hypot(bx - ax, by - ay);
  if (length <= 0) return;
  const double dx = (ay - by) / (2 * length),
               dy = (bx - ax) / (2 * length);  // half a pixel, perpendicular to the line
  AddTriangle(ax + dx, ay + dy, ax - dx, ay - dy, bx - dx, by - dy, color);
  AddTriangle(ax + dx, ay + dy, bx - dx, by - dy, bx + dx, by + dy, color);
}

void ScreenWriter::AddBox(double x, double y, double width, double height, const Rgba& color) {
  AddTriangle(x, y, x + width, y, x + width, y + height, color);
  AddTriangle(x, y, x + width, y + height, x, y + height, color);
}

void ScreenWriter::AddOctagon(double x, double y, double width, double height, double margin,
                              const Rgba& color) {
  AddBox(x - margin, y, width + 2 * margin, height, color);
  const double top = y + height, right = x + width;
  AddBox(x, y - margin, width, margin, color);
  AddBox(x, top, width, margin, color);
  AddTriangle(x - margin, y, x, y - margin, x, y, color);
  AddTriangle(right, y, right, y - margin, right + margin, y, color);
  AddTriangle(right, top, right + margin, top, right, top + margin, color);
  AddTriangle(x, top, x, top + margin, x - margin, top, color);
}

void ScreenWriter::AddBubble(std::string_view text, double x, double y) {
  const double width = font_.Width(text), height = font_.height();
  x = std::round(x) + kMargin;
  y = std::round(y) + kMargin;
  AddOctagon(x, y, width, height, kMargin + 1, kBlack);
  AddOctagon(x, y, width, height, kMargin, kPink);
  font_.Append(text, x, y + font_.descent(), kBlack, &vertices_);
}

void ScreenWriter::AddText(std::string_view text, double x, double y, const Rgba& color,
                           Align align) {
  if (align != Align::kLeft) x -= FractionOf(align) * font_.Width(text);
  font_.Append(text, x, y, color, &vertices_);
}

/// Draws a white rim around the text, which keeps it readable on dark bodies.
void ScreenWriter::AddHaloedText(std::string_view text, double x, double y, const Rgba& color) {
  x = std::round(x);
  y = std::round(y);
  for (const double dx : {-1.0, 0.0, 1.0})
    for (const double dy : {-1.0, 0.0, 1.0})
      if (dx != 0 || dy != 0) AddText(text, x + dx, y + dy, kWhite);
  AddText(text, x, y, color);
}

/// Breaks at line ends, and at the last space before a line exceeds the width. Words stay whole.
std::vector<std::string_view> ScreenWriter::BreakLines(std::string_view text, double width) {
  std::vector<std::string_view> lines;
  size_t start = 0, space = std::string_view::npos;
  for (size_t i = 0; i <= text.size(); i++) {
    const bool ends = i == text.size() || text[i] == '\n';
    if (!ends && text[i] != ' ') continue;
    if (space != std::string_view::npos && font_.Width(text.substr(start, i - start)) > width) {
      lines.push_back(text.substr(start, space - start));
      start = space + 1;
    }
    space = ends ? std::string_view::npos : i;
    if (!ends) continue;
    lines.push_back(text.substr(start, i - start));
    start = i + 1;
  }
  return lines;
}

void ScreenWriter::AddParagraph(std::string_view text, const TextBox& box, const Rgba& color) {
  const double infinite = std::numeric_limits<double>::infinity();
  const auto lines = BreakLines(text, box.wrap ? box.x.max - box.x.min : infinite);
  const double height = font_.height() * static_cast<double>(lines.size());
  const double x = box.x.min + FractionOf(box.across) * (box.x.max - box.x.min);
  double y = box.y.min + FractionOf(box.up) * (box.y.max - box.y.min - height) + height;
  for (const std::string_view line : lines) {
    y -= font_.height();
    AddText(line, x, y + font_.descent(), color, box.across);
  }
}

void ScreenWriter::AddLabels(const Painting& painting, const view::Projection& projection) {
  for (const Label& label : painting.labels) {
    const auto at =
        projection.ToPixels(point3_t(double{label.x}, double{label.y}, double{label.z}));
    if (!at || at->z < 0 || at->z > 1) continue;
    const std::string_view text = painting.TextOf(label);
    if (label.kind == LabelKind::kBubble) {
      AddBubble(text, at->x, at->y);
      continue;
    }
    const double width = font_.Width(text), canvas = projection.width();
    double x = at->x - FractionOf(label.align) * width;
    // A label stays in view if its point is in view.
    if (at->x >= 0 && at->x <= canvas) x = std::clamp(x, 0.0, std::max(canvas - width, 0.0));
    AddText(text, x, at->y, label.color);
  }
}

/// Towards the horizon, numbers get too dense. They are ordered outwards from 0 in both directions,
/// so only the last few can overlap a new one.
void ScreenWriter::AddAxisNumbers(const Painting& painting, const view::Projection& projection) {
  constexpr std::size_t kLast = 64;
  constexpr double kGap = 2;  // pixels
  struct Place {
    double x, y, width;
  };
  std::array<Place, kLast> last;
  std::size_t count = 0;
  for (const Label& label : painting.labels) {
    const auto at =
        projection.ToPixels(point3_t(double{label.x}, double{label.y}, double{label.z}));
    if (!at || at->z < 0 || at->z > 1) continue;
    const std::string_view text = painting.TextOf(label);
    const Place place{at->x, at->y, font_.Width(text)};
    bool free = true;
    for (std::size_t i = 0; i < std::min(count, kLast); i++)
      free &= place.x > last[i].x + last[i].width + kGap ||
              last[i].x > place.x + place.width + kGap ||
              std::fabs(place.y - last[i].y) > font_.height();
    if (!free) continue;
    last[count++ % kLast] = place;
    AddHaloedText(text, at->x, at->y, label.color);
  }
}

void ScreenWriter::AddClock(const std::string& text) {
  const double width = std::max(kMinClockWidth, font_.Width(text));
  AddBox(0, 0, width + 2 * kMargin, font_.height() + 2 * kMargin, kPaleBlue);
  AddText(text, kMargin, kMargin + font_.descent(), kBlack);
}

void ScreenWriter::AddOverlay(const std::vector<std::string>& lines, int canvas_height) {
  double width = 0;
  for (const std::string& line : lines) width = std::max(width, font_.Width(line));
  const double height = font_.height() * static_cast<double>(lines.size()) + 2 * kMargin;
  AddBox(0, canvas_height - height, width + 2 * kMargin, height, kGlass);
  double y = canvas_height - kMargin;
  for (const std::string& line : lines) {
    y -= font_.height();
    AddText(line, kMargin, y + font_.descent(), kBlack);
  }
}

void ScreenWriter::AddChart(const Chart& chart) {
  const double x = double{chart.x}, y = double{chart.y};
  const double width = double{chart.width}, height = double{chart.height};
  AddBox(x, y, width, height, chart.background);
  const double span = std::max(double{chart.max_value} - double{chart.min_value}, 1e-12);
  const auto level = [&](float value) {
    return y + (double{value} - double{chart.min_value}) / span * height;
  };
  const double step = width / static_cast<double>(std::max<size_t>(chart.values.size(), 2) - 1);
  for (size_t i = 1; i < chart.values.size(); i++) {
    const double from = x + static_cast<double>(i - 1) * step;
    AddLine(from, level(chart.values[i - 1]), from + step, level(chart.values[i]), chart.color);
  }
  char text[32];
  const double top = y + height - font_.height() + font_.descent();
  std::snprintf(text, sizeof text, "%.2f", double{chart.min_value});
  AddText(text, x, y + font_.descent(), kWhite);
  std::snprintf(text, sizeof text, "%.2f", double{chart.max_value});
  AddText(text, x, top, kWhite);
  AddText(chart.name, x + width - kMargin, top, kWhite, Align::kRight);
}

}  // namespace Stg::draw
