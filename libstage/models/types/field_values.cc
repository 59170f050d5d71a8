// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/field_values.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "messages/assert.hh"
#include "models/field.hh"
#include "models/state_exchange.hh"

namespace Stg {

namespace {

double WithoutTraces(double value) {
  return value < ModelField::kSmallest && value > -ModelField::kSmallest ? 0.0 : value;
}

struct RowsAround {
  const double *south, *row, *north;
};

double EvolvedCell(const RowsAround& from, size_t i, double west, double east,
                   const FieldValues::Substep& by) {
  const double middle = from.row[i], twice = middle + middle;
  const double across = by.x * ((west + east) - twice);
  const double along = by.y * ((from.south[i] + from.north[i]) - twice);
  return WithoutTraces(by.kept * (middle + (across + along)));
}

/// The loop has no branches, so that it becomes vectors.
[[gnu::always_inline]] inline void EvolveRowHere(const RowsAround& from, double* __restrict to,
                                                 size_t count,
                                                 const FieldValues::Substep& substep) {
  const FieldValues::Substep by = substep;
  const double outside_west = by.closed ? from.row[0] : 0;
  const double outside_east = by.closed ? from.row[count - 1] : 0;
  to[0] = EvolvedCell(from, 0, outside_west, count > 1 ? from.row[1] : outside_east, by);
  for (size_t i = 1; i + 1 < count; i++)
    to[i] = EvolvedCell(from, i, from.row[i - 1], from.row[i + 1], by);
  if (count > 1)
    to[count - 1] = EvolvedCell(from, count - 1, from.row[count - 2], outside_east, by);
}

using EvolveRowFunction = void (*)(const RowsAround&, double*, size_t, const FieldValues::Substep&);

void EvolveRow(const RowsAround& from, double* to, size_t count,
               const FieldValues::Substep& substep) {
  EvolveRowHere(from, to, count, substep);
}

#if defined(__x86_64__)
/// Makes the same operations in vectors of four, in two thirds of the time.
[[gnu::target("avx2")]] void EvolveRowAvx2(const RowsAround& from, double* to, size_t count,
                                           const FieldValues::Substep& substep) {
  EvolveRowHere(from, to, count, substep);
}
EvolveRowFunction ChooseEvolveRow() {
  return __builtin_cpu_supports("avx2") ? EvolveRowAvx2 : EvolveRow;
}
#else
EvolveRowFunction ChooseEvolveRow() { return EvolveRow; }
#endif

bool AnyBits(const double* row, size_t count) {
  uint64_t bits = 0;
  for (size_t i = 0; i < count; i++) bits |= std::bit_cast<uint64_t>(row[i]);
  return bits != 0;
}

}  // namespace

void FieldValues::Resize(size_t columns, size_t rows) {
  columns_ = columns;
  rows_ = rows;
  values_.assign(columns * rows, 0);
  live_.assign(rows, 0);
  next_.clear();
  next_live_.clear();
  zeros_.clear();
}

bool FieldValues::IsValid(double value) { return std::fabs(value) <= ModelField::kLargest; }

void FieldValues::Set(size_t cell, double value) {
  STAGE_ASSERT(cell < values_.size() && IsValid(value));
  values_[cell] = WithoutTraces(value);
  if (values_[cell] != 0) live_[cell / columns_] = 1;
}

void FieldValues::Add(size_t cell, double amount) {
  Set(cell, std::clamp(values_[cell] + amount, -ModelField::kLargest, ModelField::kLargest));
}

bool FieldValues::AnyLive() const {
  return std::ranges::any_of(live_, [](uint8_t live) { return live != 0; });
}

void FieldValues::Begin(const Substep& substep) {
  substep_ = substep;
  if (!substep.Spreads()) return;
  next_.resize(values_.size());
  next_live_.resize(rows_);
  if (!substep.closed) zeros_.resize(columns_);
}

void FieldValues::EvolveRows(size_t begin, size_t end) {
  STAGE_ASSERT(begin <= end && end <= rows_);
  for (size_t row = begin; row < end; row++) {
    if (!substep_.Spreads())
      Keep(row);
    else
      SpreadRow(row);
  }
}

void FieldValues::End() {
  if (!substep_.Spreads()) return;
  std::swap(values_, next_);
  std::swap(live_, next_live_);
}

bool FieldValues::IsNearLive(size_t row) const {
  return live_[row] || (row > 0 && live_[row - 1]) || (row + 1 < rows_ && live_[row + 1]);
}

void FieldValues::SpreadRow(size_t row) {
  double* const to = Row(&next_, row);
  if (!IsNearLive(row)) {
    if (next_live_[row]) std::fill_n(to, columns_, 0.0);
    next_live_[row] = 0;
    return;
  }
  const double* const from = Row(&values_, row);
  const double* const beyond = substep_.closed ? from : zeros_.data();
  const RowsAround around = {row > 0 ? from - columns_ : beyond, from,
                             row + 1 < rows_ ? from + columns_ : beyond};
  static const EvolveRowFunction evolve_row = ChooseEvolveRow();
  evolve_row(around, to, columns_, substep_);
  next_live_[row] = AnyBits(to, columns_);
}

/// Evaporation alone.
void FieldValues::Keep(size_t row) {
  if (!live_[row]) return;
  double* const values = Row(&values_, row);
  for (size_t i = 0; i < columns_; i++) values[i] = WithoutTraces(substep_.kept * values[i]);
  live_[row] = AnyBits(values, columns_);
}

void FieldValues::ExchangeState(StateExchange& exchange) {
  exchange.Expect(columns_, "the number of columns of a field");
  exchange.Expect(rows_, "the number of rows of a field");
  for (size_t row = 0; row < rows_ && !exchange.failed(); row++) {
    double* const values = Row(&values_, row);
    bool live = live_[row] && AnyBits(values, columns_);
    const bool was_live = live_[row];
    exchange(live);
    if (exchange.restoring() && !live && was_live) std::fill_n(values, columns_, 0.0);
    for (size_t i = 0; live && i < columns_; i++) {
      exchange(values[i]);
      if (!exchange.restoring()) continue;
      if (!IsValid(values[i])) exchange.Fail("found a value of a field that is not valid");
      values[i] = IsValid(values[i]) ? WithoutTraces(values[i]) : 0;
    }
    if (exchange.restoring()) live_[row] = live;
  }
}

}  // namespace Stg
