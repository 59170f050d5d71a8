// SPDX-License-Identifier: GPL-2.0-or-later
//
// Visualizers of a power pack: two charts, and a map of where energy was dissipated.

#ifndef STAGE_MODELS_ENERGY_CHARTS_HH
#define STAGE_MODELS_ENERGY_CHARTS_HH

#include <map>

#include "geometry/geometry.hh"
#include "models/visualizer.hh"

namespace Stg {

/// Dissipated energy per square of 1 m side.
class DissipationVis : public Visualizer {
 public:
  /// `max` is the maximum over all squares of all packs of the world; Accumulate() updates it.
  explicit DissipationVis(joules_t* max)
      : Visualizer("energy dissipation", "energy_dissipation"), max_(max) {}

  void Accumulate(double x, double y, joules_t amount);
  joules_t At(double x, double y) const;
  /// Maximum over all squares of all packs of the world: the reference of the shades.
  joules_t Greatest() const { return *max_; }

  const std::map<point_int_t, joules_t>& squares() const { return squares_; }

  /// Draws nothing; renderers read squares().
  void Visualize(Model*, Camera*) override {}

 private:
  std::map<point_int_t, joules_t> squares_;
  joules_t* max_;
};

class EnergyCharts {
 public:
  /// Adds the charts to the model's visualizers.
  explicit EnergyCharts(Model* model);
  ~EnergyCharts();

  StripPlotVis output, stored;
  DissipationVis dissipation;

 private:
  Model* model_;
};

}  // namespace Stg

#endif
