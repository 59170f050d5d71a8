// SPDX-License-Identifier: GPL-2.0-or-later
//
// Readings: the arrays of numbers that sensors measure. Part of <stage.hh>; C++11.
//
// A model type registers each of its readings once: its name, unit, shape and how to get it. NumPy
// arrays, logs, the browser page, ROS topics and the documentation follow from that list.
//
//   Stg::ModelTypeOf<Sonar>("sonar").Reads(
//       Stg::MakeReading("ranges", "m", "Distance in each cone.", &Sonar::ranges))

#ifndef STAGE_MODELS_READINGS_HH
#define STAGE_MODELS_READINGS_HH

#include <stddef.h>
#include <stdint.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace Stg {

class Model;

/// The lengths of up to three axes of an array in C order. No axes: a single number.
struct ReadingShape {
  static const size_t kMaxAxes = 3;
  size_t axes;
  size_t lengths[kMaxAxes];

  ReadingShape() : axes(0), lengths() {}
  explicit ReadingShape(size_t length) : axes(1), lengths{length, 0, 0} {}
  ReadingShape(size_t rows, size_t columns) : axes(2), lengths{rows, columns, 0} {}
  ReadingShape(size_t planes, size_t rows, size_t columns)
      : axes(3), lengths{planes, rows, columns} {}
  /// Number of elements from this axis inwards.
  size_t Count(size_t first_axis = 0) const {
    size_t count = 1;
    for (size_t axis = first_axis; axis < axes; axis++) count *= lengths[axis];
    return count;
  }
};

struct Reading {
  enum Element { kBool, kUint8, kInt32, kFloat, kDouble };

  std::string name;  ///< an identifier
  std::string unit;  ///< such as "m"; empty: none
  std::string description;
  Element element;
  /// The first axis is a list of detections, whose length varies from update to update.
  bool is_list;
  /// Shape of a model's array: of a list at present, of others from Load() on.
  std::function<ReadingShape(const Model&)> shape;
  /// Writes the first `length` of the array's rows, which are elements if it has one axis. Returns
  /// false if the model has no readings yet. Several threads may call it for different models.
  std::function<bool(const Model&, size_t length, void* to)> copy;
};

/// Size of an element in bytes.
size_t SizeOf(Reading::Element element);
/// Name of the type of elements in NumPy and ROS, such as "float64".
const char* NameOf(Reading::Element element);

/// Copies a model's array into the corner of a larger one of shape `space`; what does not fit is
/// left out. All other elements become NaN, or 0 if they are not floating point. `model` may be
/// null.
void CopyReading(const Reading& reading, const Model* model, const ReadingShape& space, void* to);

// ---- making descriptions ------------------------------------------------------------------------

template <typename T>
struct ReadingElement;
template <>
struct ReadingElement<bool> {
  static const Reading::Element kElement = Reading::kBool;
};
template <>
struct ReadingElement<uint8_t> {
  static const Reading::Element kElement = Reading::kUint8;
};
template <>
struct ReadingElement<int32_t> {
  static const Reading::Element kElement = Reading::kInt32;
};
template <>
struct ReadingElement<float> {
  static const Reading::Element kElement = Reading::kFloat;
};
template <>
struct ReadingElement<double> {
  static const Reading::Element kElement = Reading::kDouble;
};

/// A reading of models of class M with elements of type T: bool, uint8_t, int32_t, float or double.
template <class M, typename T>
Reading MakeReading(const std::string& name, const std::string& unit,
                    const std::string& description, ReadingShape (*shape)(const M&),
                    bool (*copy)(const M&, size_t length, T* to)) {
  Reading reading;
  reading.name = name;
  reading.unit = unit;
  reading.description = description;
  reading.element = ReadingElement<T>::kElement;
  reading.is_list = false;
  reading.shape = [shape](const Model& model) { return shape(static_cast<const M&>(model)); };
  reading.copy = [copy](const Model& model, size_t length, void* to) {
    return copy(static_cast<const M&>(model), length, static_cast<T*>(to));
  };
  return reading;
}

/// A reading that the model keeps in a vector, which has its full size from Load() on.
template <class M, typename T>
Reading MakeReading(const std::string& name, const std::string& unit,
                    const std::string& description, const std::vector<T>& (M::*numbers)() const) {
  Reading reading = MakeReading<M, T>(name, unit, description, nullptr, nullptr);
  reading.shape = [numbers](const Model& model) {
    return ReadingShape((static_cast<const M&>(model).*numbers)().size());
  };
  reading.copy = [numbers](const Model& model, size_t length, void* to) {
    const std::vector<T>& from = (static_cast<const M&>(model).*numbers)();
    std::copy(from.begin(), from.begin() + static_cast<ptrdiff_t>(length), static_cast<T*>(to));
    return true;
  };
  return reading;
}

/// A reading with an entry for each detection of a list: `put` writes one number per detection, or
/// `width` numbers if that is not 0.
template <class M, class Detection, typename T>
Reading MakeListReading(const std::string& name, const std::string& unit,
                        const std::string& description,
                        const std::vector<Detection>& (*list)(const M&),
                        void (*put)(const Detection&, T* to), size_t width = 0) {
  Reading reading = MakeReading<M, T>(name, unit, description, nullptr, nullptr);
  reading.is_list = true;
  reading.shape = [list, width](const Model& model) {
    const size_t length = list(static_cast<const M&>(model)).size();
    return width > 0 ? ReadingShape(length, width) : ReadingShape(length);
  };
  reading.copy = [list, put, width](const Model& model, size_t length, void* to) {
    const std::vector<Detection>& found = list(static_cast<const M&>(model));
    const size_t step = width > 0 ? width : 1;
    for (size_t i = 0; i < length; i++) put(found[i], static_cast<T*>(to) + i * step);
    return true;
  };
  return reading;
}

}  // namespace Stg

#endif
