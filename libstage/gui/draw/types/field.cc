// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/field.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gui/draw/field_picture.hh"
#include "gui/draw/painter.hh"
#include "gui/draw/type_picture.hh"
#include "models/host.hh"
#include "world/world.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr size_t kMaxPatches = 160;  // along an axis
constexpr int kShades = 64;
constexpr double kOpaque = 0.8;  // the floor shines through

/// Patches of equal numbers of cells; those at the northern and eastern edge may have fewer.
class FieldPicture {
 public:
  explicit FieldPicture(const ModelField& field)
      : field_(field),
        step_(1 + (std::max(field.columns(), field.rows()) - 1) / kMaxPatches),
        color_(ToRgba(field.GetColor())) {
    for (size_t row = 0; row < field.rows(); row += step_)
      for (size_t column = 0; column < field.columns(); column += step_) {
        lowest_ = std::min(lowest_, Mean(column, row));
        highest_ = std::max(highest_, Mean(column, row));
      }
  }

  void Draw(Painting* painting) const {
    if (lowest_ == 0 && highest_ == 0) return;
    Painter painter(painting);
    painter.SetFrame(field_.GetGlobalPose() + field_.GetGeom().pose);
    for (size_t row = 0; row < field_.rows(); row += step_) DrawRow(row, &painter);
  }

 private:
  double Mean(size_t column, size_t row) const {
    const size_t east = std::min(column + step_, field_.columns());
    const size_t north = std::min(row + step_, field_.rows());
    double sum = 0;
    for (size_t y = row; y < north; y++)
      for (size_t x = column; x < east; x++) sum += field_.values()[y * field_.columns() + x];
    return sum / static_cast<double>((east - column) * (north - row));
  }

  int Shade(size_t column, size_t row) const {
    if (!(highest_ > lowest_)) return kShades;
    const double share = (Mean(column, row) - lowest_) / (highest_ - lowest_);
    return static_cast<int>(std::lround(share * kShades));
  }

  /// Neighbours of equal shade become one rectangle.
  void DrawRow(size_t row, Painter* painter) const {
    size_t begin = 0;
    int shade = Shade(0, row);
    for (size_t column = step_; column < field_.columns(); column += step_) {
      const int next = Shade(column, row);
      if (next == shade) continue;
      DrawRun(begin, column, row, shade, painter);
      begin = column;
      shade = next;
    }
    DrawRun(begin, field_.columns(), row, shade, painter);
  }

  void DrawRun(size_t west, size_t east, size_t row, int shade, Painter* painter) const {
    if (shade == 0) return;
    const Size size = field_.GetGeom().size;
    const auto place = [](size_t cell, double side, double length) {
      return static_cast<double>(cell) * side - length / 2;
    };
    const size_t north = std::min(row + step_, field_.rows());
    const double width = field_.CellWidth(), height = field_.CellHeight();
    painter->SetColor(color_.WithOpacity(kOpaque * shade / kShades));
    painter->Rectangle(Bounds(place(west, width, size.x), place(east, width, size.x)),
                       Bounds(place(row, height, size.y), place(north, height, size.y)), 0);
  }

  const ModelField& field_;
  const size_t step_;
  const Rgba color_;
  double lowest_ = std::numeric_limits<double>::infinity();
  double highest_ = -std::numeric_limits<double>::infinity();
};

// DrawFields() draws them whether data are shown or not.
[[maybe_unused]] const bool kRegistered = RegisterPicture(PictureOf<ModelField>({Show::kFields}));

}  // namespace

void DrawFields(World& world, Painting* painting) {
  for (const ModelField* field : world.host().fields) FieldPicture(*field).Draw(painting);
}

}  // namespace Stg::draw
