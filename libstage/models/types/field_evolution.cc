// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/field_evolution.hh"

#include <algorithm>
#include <cmath>

#include "geometry/exponential.hh"

namespace Stg::field {

namespace {

// Largest sum of the two coefficients of a substep. The scheme is stable up to 0.5, where a
// checkered pattern stays for ever; here it shrinks to 0.6 of its contrast.
constexpr double kStable = 0.4;

/// Coefficient of diffusion along an axis with cells of this length.
double Coefficient(double diffusion, double seconds, double cell) {
  return diffusion * seconds / (cell * cell);
}

/// The pixels along an axis that belong to a cell: at least one.
struct Interval {
  size_t begin, end;
};

Interval PixelsOf(size_t cell, size_t cells, size_t pixels) {
  const size_t begin = cell * pixels / cells, end = ((cell + 1) * pixels + cells - 1) / cells;
  return {begin, std::max(begin + 1, end)};
}

}  // namespace

int CountSubsteps(const ModelField& field, double seconds) {
  const double sum = Coefficient(field.diffusion(), seconds, field.CellWidth()) +
                     Coefficient(field.diffusion(), seconds, field.CellHeight());
  const double count = std::ceil(sum / kStable - 1e-9);  // rounding takes no further substep
  if (!(count <= kMaxSubsteps)) return kMaxSubsteps + 1;
  return std::max(1, static_cast<int>(count));
}

FieldValues::Substep SubstepOf(const ModelField& field, double seconds, int count) {
  const double time = seconds / count;
  FieldValues::Substep substep;
  substep.closed = field.is_closed();
  substep.kept = Exponential(-field.evaporation() * time);
  substep.x = Coefficient(field.diffusion(), time, field.CellWidth());
  substep.y = Coefficient(field.diffusion(), time, field.CellHeight());
  const double sum = substep.x + substep.y;
  if (!std::isfinite(sum)) {
    substep.x = substep.y = 0;
  } else if (count >= kMaxSubsteps && sum > kStable) {
    substep.x *= kStable / sum;
    substep.y *= kStable / sum;
  }
  return substep;
}

double Brightness(const picture::Samples& picture, const FieldValues& values, size_t column,
                  size_t row) {
  const auto width = static_cast<size_t>(picture.width);
  const auto height = static_cast<size_t>(picture.height);
  const auto channels = static_cast<size_t>(picture.channels);
  const size_t colors = channels >= 3 ? 3 : 1;
  const Interval x = PixelsOf(column, values.columns(), width);
  const Interval y = PixelsOf(values.rows() - 1 - row, values.rows(), height);
  uint64_t sum = 0;
  for (size_t line = y.begin; line < y.end; line++)
    for (size_t pixel = x.begin; pixel < x.end; pixel++)
      for (size_t color = 0; color < colors; color++)
        sum += picture.values[(line * width + pixel) * channels + color];
  const size_t count = (x.end - x.begin) * (y.end - y.begin) * colors;
  return static_cast<double>(sum) / (255.0 * static_cast<double>(count));
}

}  // namespace Stg::field
