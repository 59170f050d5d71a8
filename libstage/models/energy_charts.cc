// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/energy_charts.hh"

#include <algorithm>
#include <cmath>

#include "models/host.hh"
#include "models/model.hh"

namespace Stg {

namespace {

constexpr size_t kChartLength = 1200;
constexpr float kChartWidth = 200, kChartHeight = 40;  // pixels

/// Index of a square; clamped to +-2^30.
int SquareOf(double metres) {
  constexpr double kFarthest = 1 << 30;
  return std::isnan(metres)
             ? 0
             : static_cast<int>(std::floor(constrain(metres, -kFarthest, kFarthest)));
}

point_int_t SquareOf(double x, double y) { return point_int_t(SquareOf(x), SquareOf(y)); }

}  // namespace

void DissipationVis::Accumulate(double x, double y, joules_t amount) {
  joules_t& sum = squares_[SquareOf(x, y)];
  sum += amount;
  *max_ = std::max(*max_, sum);
}

joules_t DissipationVis::At(double x, double y) const {
  const auto found = squares_.find(SquareOf(x, y));
  return found == squares_.end() ? 0 : found->second;
}

EnergyCharts::EnergyCharts(Model* model)
    // World files call it "energy_input".
    : output(0, 100, kChartWidth, kChartHeight, kChartLength, Color(1, 0, 0), Color(0, 0, 0, 0.5),
             "energy output", "energy_input"),
      stored(0, 142, kChartWidth, kChartHeight, kChartLength, Color(0, 1, 0), Color(0, 0, 0, 0.5),
             "energy stored", "energy_stored"),
      dissipation(&model->host().max_dissipation),
      model_(model) {
  model_->AddVisualizer(&output, false);
  model_->AddVisualizer(&stored, false);
  model_->AddVisualizer(&dissipation, false);
}

EnergyCharts::~EnergyCharts() {
  model_->RemoveVisualizer(&output);
  model_->RemoveVisualizer(&stored);
  model_->RemoveVisualizer(&dissipation);
}

}  // namespace Stg
