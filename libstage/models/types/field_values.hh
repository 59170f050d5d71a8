// SPDX-License-Identifier: GPL-2.0-or-later
//
// The values of a field, and the five-point scheme by which they spread and evaporate.
//
// A substep computes each cell from the cells before it, in one order of operations, so that
// neither the number of threads nor the width of vectors changes a bit. Rows in which all values
// are 0, and whose neighbours are such rows, are skipped.

#ifndef STAGE_MODELS_TYPES_FIELD_VALUES_HH
#define STAGE_MODELS_TYPES_FIELD_VALUES_HH

#include <cstddef>
#include <cstdint>
#include <vector>

namespace Stg {

class StateExchange;

class FieldValues {
 public:
  /// Coefficients of a substep of duration t.
  struct Substep {
    double x = 0, y = 0;  ///< diffusion * t / width^2 and / height^2 of a cell; sum at most 0.4
    double kept = 1;      ///< exp(-evaporation * t)
    bool closed = true;   ///< cells beyond the edge have the value of those at the edge; otherwise
                          ///< they are 0
    bool Spreads() const { return x > 0 || y > 0; }
  };

  /// All values are 0.
  void Resize(size_t columns, size_t rows);
  size_t columns() const { return columns_; }
  size_t rows() const { return rows_; }
  const std::vector<double>& all() const { return values_; }
  double At(size_t column, size_t row) const { return values_[row * columns_ + column]; }
  /// Numbers that are not finite or beyond ModelField::kLargest are refused: the result is false.
  static bool IsValid(double value);
  /// Sets a cell to a valid value. One that is nearer to 0 than ModelField::kSmallest becomes 0.
  void Set(size_t cell, double value);
  /// Adds an amount to a cell, up to the largest valid value.
  void Add(size_t cell, double amount);

  /// True if there may be a value other than 0.
  bool AnyLive() const;
  /// A substep: Begin(), then EvolveRows() for all rows, by any number of threads, then End().
  void Begin(const Substep& substep);
  void EvolveRows(size_t begin, size_t end);
  void End();

  /// Rows of zeros take one byte each.
  void ExchangeState(StateExchange& exchange);

 private:
  double* Row(std::vector<double>* values, size_t row) { return values->data() + row * columns_; }
  bool IsNearLive(size_t row) const;
  void SpreadRow(size_t row);
  void Keep(size_t row);

  size_t columns_ = 0, rows_ = 0;
  std::vector<double> values_, next_;  // next_ is empty until values spread
  // Whether each row may have values other than 0. For next_: whether it does, since it was made.
  std::vector<uint8_t> live_, next_live_;
  std::vector<double> zeros_;  // a row beyond an open edge
  Substep substep_;
};

}  // namespace Stg

#endif
