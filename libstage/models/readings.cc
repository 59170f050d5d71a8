// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/readings.hh"

#include <cstring>
#include <limits>

namespace Stg {

namespace {

/// Marks elements as unknown.
void Fill(Reading::Element element, size_t count, void* to) {
  if (element == Reading::kDouble)
    std::fill_n(static_cast<double*>(to), count, std::numeric_limits<double>::quiet_NaN());
  else if (element == Reading::kFloat)
    std::fill_n(static_cast<float*>(to), count, std::numeric_limits<float>::quiet_NaN());
  else
    std::memset(to, 0, count * SizeOf(element));
}

bool HasRowsOf(const ReadingShape& one, const ReadingShape& other) {
  for (size_t axis = 1; axis < one.axes; axis++)
    if (one.lengths[axis] != other.lengths[axis]) return false;
  return true;
}

/// Copies the corner of an array of shape `shape` into that of another one, from `axis` inwards.
void CopyCorner(const ReadingShape& shape, const ReadingShape& space, size_t axis, size_t size,
                const char* from, char* to) {
  const size_t length = std::min(shape.lengths[axis], space.lengths[axis]);
  if (axis + 1 == space.axes) {
    std::memcpy(to, from, length * size);
    return;
  }
  for (size_t i = 0; i < length; i++)
    CopyCorner(shape, space, axis + 1, size, from + i * shape.Count(axis + 1) * size,
               to + i * space.Count(axis + 1) * size);
}

}  // namespace

size_t SizeOf(Reading::Element element) {
  constexpr size_t kSizes[] = {sizeof(bool), 1, 4, sizeof(float), sizeof(double)};
  return kSizes[element];
}

const char* NameOf(Reading::Element element) {
  constexpr const char* kNames[] = {"bool", "uint8", "int32", "float32", "float64"};
  return kNames[element];
}

void CopyReading(const Reading& reading, const Model* model, const ReadingShape& space, void* to) {
  const size_t size = SizeOf(reading.element), total = space.Count();
  ReadingShape shape = model ? reading.shape(*model) : space;
  if (!model || shape.axes != space.axes) return Fill(reading.element, total, to);
  const size_t length = space.axes > 0 ? std::min(shape.lengths[0], space.lengths[0]) : 1;
  shape.lengths[0] = length;
  if (HasRowsOf(shape, space)) {
    const size_t known = reading.copy(*model, length, to) ? shape.Count() : 0;
    return Fill(reading.element, total - known, static_cast<char*>(to) + known * size);
  }
  Fill(reading.element, total, to);
  static thread_local std::vector<char> dense;  // static to reuse its memory
  dense.resize(shape.Count() * size);
  if (reading.copy(*model, length, dense.data()))
    CopyCorner(shape, space, 0, size, dense.data(), static_cast<char*>(to));
}

}  // namespace Stg
