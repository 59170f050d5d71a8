// SPDX-License-Identifier: GPL-2.0-or-later
//
// The columns of rows as a device has them: the same elements, except that NoisyOdometry has a
// layout of its own there.

#ifndef STAGE_ROWS_DEVICE_COLUMNS_HH
#define STAGE_ROWS_DEVICE_COLUMNS_HH

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include "kernels/row_records.h"
#include "rows/rows.hh"

namespace Stg::rows {

/// Calls f(ROW_..., column) for each column that devices have.
template <class Columns, typename F>
void ForEachDeviceColumn(Columns* c, F f) {
  f(ROW_SEED, &c->seed);
  f(ROW_TIME, &c->time);
  f(ROW_NEXT_UPDATE, &c->next_update);
  f(ROW_LAST_UPDATE, &c->last_update);
  f(ROW_STEPS, &c->steps);
  f(ROW_EXTENT, &c->extent);
  f(ROW_STAMPS, &c->stamps);
  f(ROW_POSE, &c->pose);
  f(ROW_TURN, &c->turn);
  f(ROW_VELOCITY, &c->velocity);
  f(ROW_COMMAND, &c->command);
  f(ROW_SENSED, &c->sensed);
  f(ROW_MODE, &c->mode);
  f(ROW_STALLED, &c->stalled);
  f(ROW_WATTS, &c->watts);
  f(ROW_STEERING, &c->steering);
  f(ROW_STORED, &c->stored);
  f(ROW_DISSIPATED, &c->dissipated);
  f(ROW_ENERGY, &c->energy);
  f(ROW_ESTIMATE, &c->estimate);
  f(ROW_DRIVEN, &c->driven);
  f(ROW_ERROR, &c->error);
  f(ROW_NOISY_ODOMETRY, &c->noisy_odometry);
  f(ROW_RANDOM, &c->random);
  f(ROW_MEMORY, &c->memory);
  f(ROW_BOX, &c->box);
  f(ROW_STAMP, &c->stamp);
  f(ROW_BITS, &c->bits);
  f(ROW_NOISE, &c->noise);
  f(ROW_RANGES, &c->ranges);
  f(ROW_BRIGHTNESS, &c->brightness);
  f(ROW_MADE, &c->made);
  f(ROW_HINDERED, &c->hindered);
  f(ROW_BEFORE, &c->before);
  f(ROW_VARIED, &c->varied);
  f(ROW_PROPERTIES, &c->properties);
  f(ROW_RANGE_NOISE, &c->range_noise);
}

/// The type of an element on devices.
template <class T>
struct OnDevice {
  using Type = T;
};
template <>
struct OnDevice<NoisyOdometry> {
  using Type = row_noisy_odometry_t;
};
template <class T>
inline constexpr size_t kSizeOnDevice = sizeof(typename OnDevice<T>::Type);

static_assert(sizeof(Planar) == sizeof(row_planar_t));
static_assert(sizeof(SineCosine) == sizeof(row_turn_t));
static_assert(sizeof(OutlineBox) == sizeof(row_box_t));
static_assert(sizeof(internal::grid::CellBox) == sizeof(row_extent_t));
static_assert(sizeof(RandomStream) == sizeof(row_random_t));
static_assert(sizeof(EnergyTotals) == sizeof(row_energy_t));
static_assert(sizeof(MoverProperties) == sizeof(row_properties_t));
static_assert(sizeof(RangeNoise) == sizeof(row_range_noise_t));

/// Copies the numbers of a NoisyOdometry from or to a record.
template <bool from_record>
class OdometryCopy {
 public:
  explicit OdometryCopy(double* record) : next_(record) {}
  template <class... T>
  void operator()(T&... values) {
    (Copy(&values), ...);
  }

 private:
  void Copy(double* value) {
    (from_record ? *value : *next_) = from_record ? *next_ : *value;
    next_++;
  }
  void Copy(PoseCovariance* covariance) { covariance->ExchangeState(*this); }
  void Copy(Velocity* v) { (*this)(v->x, v->y, v->z, v->a); }

  double* next_;
};

/// Copies elements of a column from the host's form to the device's, which need not be aligned.
template <class T>
void ToDevice(const T* from, size_t count, std::byte* to) {
  if constexpr (std::is_same_v<T, NoisyOdometry>) {
    for (size_t i = 0; i < count; i++) {
      row_noisy_odometry_t record;
      NoisyOdometry copy = from[i];
      OdometryCopy<false> exchange(&record.translation_per_metre);
      copy.ExchangeState(exchange);
      std::memcpy(to + i * sizeof record, &record, sizeof record);
    }
  } else if (count > 0) {
    std::memcpy(to, from, count * sizeof(T));
  }
}

/// Copies elements of a column from the device's form to the host's.
template <class T>
void FromDevice(const std::byte* from, size_t count, T* to) {
  if constexpr (std::is_same_v<T, NoisyOdometry>) {
    for (size_t i = 0; i < count; i++) {
      row_noisy_odometry_t record;
      std::memcpy(&record, from + i * sizeof record, sizeof record);
      OdometryCopy<true> exchange(&record.translation_per_metre);
      to[i].ExchangeState(exchange);
    }
  } else if (count > 0) {
    std::memcpy(static_cast<void*>(to), from, count * sizeof(T));
  }
}

}  // namespace Stg::rows

#endif
