// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelField: numbers on the floor, such as the concentration of a pheromone, a temperature or the
// brightness of the ground. Part of <stage.hh>.
//
// A field is a rectangle of equal cells with a value each. It has a pose and a size, but no body.
// Ground sensors read it, and write it on behalf of their robots. Values evaporate and spread:
//
//   du/dt = diffusion (d2u/dx2 + d2u/dy2) - evaporation u
//
// At each multiple of the update interval the field makes one step of the five-point scheme, or
// several equal ones if otherwise diffusion * time * (1/width^2 + 1/height^2) of a cell would
// exceed 0.4; above 0.5 the scheme is unstable. All values are multiplied by exp(-evaporation *
// time) in each of these steps. Values nearer to 0 than kSmallest become 0.

#ifndef STAGE_MODELS_FIELD_HH
#define STAGE_MODELS_FIELD_HH

#include <stddef.h>

#include <memory>
#include <string>
#include <vector>

#include "models/model.hh"

namespace Stg {

class FieldPhase;
class FieldValues;

class ModelField : public Model {
 public:
  static constexpr double kSmallest = 1e-30;  ///< values nearer to 0 become 0
  static constexpr double kLargest = 1e100;   ///< values are at most this far from 0

  ModelField(World* world, Model* parent, const std::string& type);
  ~ModelField();

  // Values can be read and written between steps and by callbacks that are not parallel. Parallel
  // ones use ModelGroundSensor.

  size_t columns() const;
  size_t rows() const;
  meters_t CellWidth() const { return geom.size.x / static_cast<double>(columns()); }
  meters_t CellHeight() const { return geom.size.y / static_cast<double>(rows()); }
  /// All values, row by row from the south (the smallest y in the field's frame), each row from the
  /// west.
  const std::vector<double>& values() const;
  /// Sum of the values, each times the area of a cell.
  double Integral() const;

  /// Value at a global place, interpolated bilinearly between the middles of cells; constant
  /// between these and the edge. 0 outside.
  double LinearValue(double x, double y) const;
  /// Value of the cell at a global place; 0 outside.
  double NearestValue(double x, double y) const;
  /// Adds `amount` / (area of a cell) to the cell at a global place, so that the integral grows by
  /// `amount`. Returns false without an effect outside, or if `amount` is not finite.
  bool Deposit(double x, double y, double amount);
  /// Sets the cell at a global place. Returns false without an effect outside, or if the value is
  /// not finite or too large.
  bool SetValue(double x, double y, double value);
  /// Sets all values, in the order of values(). Returns false without an effect if the number of
  /// values or one of them is wrong.
  bool SetValues(const double* from, size_t count);

  double diffusion() const { return diffusion_; }      ///< m^2/s
  double evaporation() const { return evaporation_; }  ///< 1/s
  bool is_closed() const {
    return closed_;
  }  ///< nothing spreads over the edge; otherwise it is
     ///< lost there
  /// Time between two grids of values in logs; 0: logs have none.
  usec_t GetLogInterval() const { return log_interval_; }
  /// Return false without an effect if the number is negative or not finite.
  bool SetDiffusion(double square_metres_per_second);
  bool SetEvaporation(double per_second);

  using Model::Load;
  void Load() override;
  void ExchangeState(StateExchange& exchange) override;

 private:
  friend class FieldPhase;

  void LoadCells();
  void LoadEvolution();
  void LoadValues();
  bool FindCell(double x, double y, size_t* cell) const;
  bool ToCells(double x, double y, double* column, double* row) const;

  std::unique_ptr<FieldValues> values_;
  double diffusion_, evaporation_;
  bool closed_, has_cells_;
  usec_t evolved_to_;  // a multiple of the update interval
  usec_t log_interval_;
};

}  // namespace Stg

#endif
