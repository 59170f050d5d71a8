// SPDX-License-Identifier: GPL-2.0-or-later
//
// One list of what a class keeps, for all who need it: the state hash, those who put a world back
// to where it was. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_STATE_EXCHANGE_HH
#define STAGE_MODELS_STATE_EXCHANGE_HH

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <string>
#include <type_traits>
#include <vector>

#include "geometry/color.hh"
#include "geometry/geometry.hh"
#include "geometry/random.hh"

namespace Stg {

class Model;

/// Visits the state of models value by value. What it does with a value is up to who made it: it
/// saves it as bytes, restores it from bytes that were saved, or hashes it. A class lists each
/// value that decides its future once, in an order that depends on nothing else:
///
///     void ModelSonar::ExchangeState(StateExchange& exchange) {
///       Model::ExchangeState(exchange);
///       exchange(gain_, readings_, nearest_);
///     }
///
/// Values may be numbers, bool, enumerations, strings, the geometry and colours of this library,
/// random streams, pointers to models of the same world (also null), arrays and vectors of these,
/// and classes with such a function of their own. The bytes are the same on every processor.
class StateExchange {
 public:
  typedef std::vector<unsigned char> Bytes;

  /// Hashes (FNV-1a, http://www.isthe.com/chongo/tech/comp/fnv). `models`: those of the world, in
  /// the order of creation.
  explicit StateExchange(const std::vector<Model*>& models);
  /// Saves: appends to *to.
  StateExchange(const std::vector<Model*>& models, Bytes* to);
  /// Restores what was saved of models of the same kind, in the same order.
  StateExchange(const std::vector<Model*>& models, const unsigned char* from, size_t size);

  template <typename... T>
  void operator()(T&... values) {
    const int in_order[] = {0, (Exchange(values), 0)...};
    static_cast<void>(in_order);
  }
  /// A model that may have been deleted meanwhile, and the number that it had: `model` is not
  /// followed.
  void Reference(Model*& model, uint32_t& id);
  /// How many values follow, each of a byte at least: restoring, as many as there were.
  uint64_t Count(uint64_t count);
  /// For what is no variable: it is saved and hashed, and restoring fails if it differs from what
  /// was saved.
  void Expect(uint64_t value, const char* what);

  bool restoring() const { return use_ == kRestore; }
  bool hashing() const { return use_ == kHash; }
  /// Restoring fails with this message, unless it has failed before. All further values stay as
  /// they are.
  void Fail(const std::string& message);
  bool failed() const { return failed_; }
  const std::string& message() const { return message_; }
  /// Of all values so far, if it hashes.
  uint64_t hash() const { return hash_; }
  /// Those that it was made with.
  const std::vector<Model*>& models() const { return models_; }
  /// Bytes that are left to restore from.
  size_t left() const { return static_cast<size_t>(end_ - from_); }

 private:
  enum Use { kHash, kSave, kRestore };

  StateExchange(const StateExchange&);
  StateExchange& operator=(const StateExchange&);

  /// The lowest `bytes` bytes of *bits.
  void Number(uint64_t* bits, size_t bytes);

  template <typename T>
  typename std::enable_if<std::is_integral<T>::value>::type Exchange(T& value) {
    uint64_t bits = static_cast<uint64_t>(value);
    Number(&bits, sizeof value);
    value = static_cast<T>(bits);
  }
  template <typename T>
  typename std::enable_if<std::is_enum<T>::value>::type Exchange(T& value) {
    int32_t number = static_cast<int32_t>(value);
    Exchange(number);
    value = static_cast<T>(number);
  }
  void Exchange(double& value);
  void Exchange(float& value);
  void Exchange(std::string& text);
  void Exchange(Pose& pose);
  void Exchange(Velocity& velocity) { Exchange(static_cast<Pose&>(velocity)); }
  void Exchange(Size& size) { (*this)(size.x, size.y, size.z); }
  void Exchange(Geom& geom) { (*this)(geom.pose, geom.size); }
  void Exchange(Bounds& bounds) { (*this)(bounds.min, bounds.max); }
  void Exchange(point_t& point) { (*this)(point.x, point.y); }
  void Exchange(point3_t& point) { (*this)(point.x, point.y, point.z); }
  void Exchange(Color& color) { (*this)(color.r, color.g, color.b, color.a); }
  void Exchange(RandomStream& stream);
  void Exchange(LazyRandomStream& stream);
  void Exchange(Model*& model);
  template <typename T, size_t N>
  void Exchange(T (&values)[N]) {
    for (size_t i = 0; i < N; i++) Exchange(values[i]);
  }
  template <typename T>
  void Exchange(std::vector<T>& values) {
    const uint64_t size = Count(values.size());
    if (restoring() && !failed_) values.resize(static_cast<size_t>(size));
    for (T& value : values) Exchange(value);
  }
  /// Classes with a list of their own.
  template <typename T>
  auto Exchange(T& value) -> decltype(value.ExchangeState(*this)) {
    value.ExchangeState(*this);
  }

  const std::vector<Model*>& models_;
  const Use use_;
  Bytes* const to_;
  const unsigned char* from_;
  const unsigned char* const end_;
  uint64_t hash_;
  bool failed_;
  std::string message_;
};

/// Something that keeps state beside a model, such as what a controller remembers.
class StateKeeper {
 public:
  virtual ~StateKeeper() {}
  virtual void ExchangeState(StateExchange& exchange) = 0;
};

}  // namespace Stg

#endif
