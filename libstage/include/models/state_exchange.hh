// SPDX-License-Identifier: GPL-2.0-or-later
//
// Enumerates the state of a class once for all purposes: hashing, saving and restoring. Part of
// <stage.hh>; C++11.

#ifndef STAGE_MODELS_STATE_EXCHANGE_HH
#define STAGE_MODELS_STATE_EXCHANGE_HH

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <string>
#include <type_traits>
#include <vector>

#include "geometry/geometry.hh"
#include "pictures/color.hh"
#include "random/fnv1a.hh"
#include "random/random.hh"

namespace Stg {

class Model;

/// Visits the state of models value by value. Depending on its constructor, it saves each value as
/// bytes, restores it from saved bytes, or hashes it. A class lists each value that decides its
/// future once, always in the same order:
///
///     void ModelSonar::ExchangeState(StateExchange& exchange) {
///       Model::ExchangeState(exchange);
///       exchange(gain_, readings_, nearest_);
///     }
///
/// Values may be numbers, bool, enumerations, strings, geometry and colours of this library, random
/// streams, pointers to models of the same world or null, arrays and vectors of these, and classes
/// with an ExchangeState() function. The bytes are the same on every processor.
class StateExchange {
 public:
  typedef std::vector<unsigned char> Bytes;

  /// Hashes the values (FNV-1a). `models` are those of
  /// the world in the order of creation.
  explicit StateExchange(const std::vector<Model*>& models);
  /// Saves the values: appends to *to, which is complete after Finish().
  StateExchange(const std::vector<Model*>& models, Bytes* to);
  /// Restores values saved from models of the same types in the same order.
  StateExchange(const std::vector<Model*>& models, const unsigned char* from, size_t size);

  ~StateExchange() { Finish(); }

  template <typename... T>
  void operator()(T&... values) {
    const int in_order[] = {0, (Exchange(values), 0)...};
    static_cast<void>(in_order);
  }
  /// Exchanges `size` bytes that do not depend on the processor.
  void Plain(void* bytes, size_t size);
  /// Exchanges a pointer to a model that may have been deleted, and its id. The pointer is not
  /// dereferenced.
  void Reference(Model*& model, uint32_t& id);
  /// Exchanges the number of following values, each of at least one byte. Returns it.
  size_t Count(size_t count);
  /// Saves and hashes a value that is not a variable. Restoring fails if the saved value differs.
  void Expect(uint64_t value, const char* what);

  bool restoring() const { return use_ == kRestore; }
  bool hashing() const { return use_ == kHash; }
  /// True if readings that will be replaced before anything can read them are omitted: the model
  /// saves no readings, and keeps its own when restored.
  bool omits_readings() const { return omits_readings_; }
  [[deprecated("use omits_readings()")]] bool leaves_readings_out() const {
    return omits_readings();
  }
  void OmitReadings(bool leave) { omits_readings_ = leave; }
  /// Makes restoring fail with this message, unless it has failed already. Later values stay
  /// unchanged.
  void Fail(const std::string& message);
  bool failed() const { return failed_; }
  const std::string& message() const { return message_; }
  /// Hash of all values so far, when hashing.
  uint64_t hash() const { return hash_; }
  /// The models passed to the constructor.
  const std::vector<Model*>& models() const { return models_; }
  /// When restoring: number of bytes left.
  size_t left() const { return static_cast<size_t>(end_ - at_); }
  /// When saving: number of bytes saved.
  size_t saved() const { return static_cast<size_t>(at_ - to_->data()); }
  /// When saving: trims *to to its final size. Call it before reading *to.
  void Finish();

 private:
  enum Use { kHash, kSave, kRestore };

  StateExchange(const StateExchange&);
  StateExchange& operator=(const StateExchange&);

  /// Exchanges the lowest kBytes bytes of *bits, lowest first.
  template <size_t kBytes>
  void Number(uint64_t* bits) {
    if (use_ == kHash) {
      for (size_t i = 0; i < kBytes; i++) HashByte(*bits >> 8 * i & 0xff);
      return;
    }
    if (left() < kBytes) Reserve(kBytes);
    if (failed_) return;
    if (use_ == kSave)
      PutLittleEndian<kBytes>(*bits);
    else
      GetLittleEndian<kBytes>(bits);
    at_ += kBytes;
  }
#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  template <size_t kBytes>
  void PutLittleEndian(const uint64_t& bits) {
    memcpy(at_, &bits, kBytes);
  }
  template <size_t kBytes>
  void GetLittleEndian(uint64_t* bits) {
    *bits = 0;
    memcpy(bits, at_, kBytes);
  }
#else
  template <size_t kBytes>
  void PutLittleEndian(uint64_t bits) {
    for (size_t i = 0; i < kBytes; i++) at_[i] = static_cast<unsigned char>(bits >> 8 * i);
  }
  template <size_t kBytes>
  void GetLittleEndian(uint64_t* bits) {
    *bits = 0;
    for (size_t i = 0; i < kBytes; i++) *bits |= static_cast<uint64_t>(at_[i]) << 8 * i;
  }
#endif
  void HashByte(uint64_t byte) { hash_ = Fnv1aStep(hash_, byte); }
  /// When saving: reserves space for `bytes` more bytes. When restoring: fails, as too few are
  /// left.
  void Reserve(size_t bytes);

  template <typename T>
  typename std::enable_if<std::is_integral<T>::value>::type Exchange(T& value) {
    // Sign-extended; only the lowest sizeof(T) bytes are used.
    uint64_t bits = static_cast<uint64_t>(value);  // NOLINT(bugprone-signed-char-misuse)
    Number<sizeof(T)>(&bits);
    value = static_cast<T>(bits);
  }
  void Exchange(double& value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    Number<sizeof bits>(&bits);
    memcpy(&value, &bits, sizeof bits);
  }
  void Exchange(float& value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    Exchange(bits);
    memcpy(&value, &bits, sizeof bits);
  }
  template <typename T>
  typename std::enable_if<std::is_enum<T>::value>::type Exchange(T& value) {
    int32_t number = static_cast<int32_t>(value);
    Exchange(number);
    value = static_cast<T>(number);
  }
  void Exchange(std::string& text);
  void Exchange(Pose& pose) { (*this)(pose.x, pose.y, pose.z, pose.a); }
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
    const size_t size = Count(values.size());
    if (restoring() && !failed_) values.resize(size);
    for (T& value : values) Exchange(value);
  }
  /// For classes with an ExchangeState() function.
  template <typename T>
  auto Exchange(T& value) -> decltype(value.ExchangeState(*this)) {
    value.ExchangeState(*this);
  }

  const std::vector<Model*>& models_;
  const Use use_;
  Bytes* const to_;
  // Saving: where in *to_ the next byte goes, and the end of the reserved space. Restoring: the
  // rest of the input, which is not written to.
  unsigned char *at_, *end_;
  uint64_t hash_;
  bool failed_, omits_readings_;
  std::string message_;
};

/// An object that keeps state for a model, such as a controller's memory.
class StateKeeper {
 public:
  virtual ~StateKeeper() {}
  virtual void ExchangeState(StateExchange& exchange) = 0;
  /// True if ExchangeState() restores any state that it has saved: it calls neither Fail() nor
  /// Expect(), and does not throw. Worlds are restored in less time if all keepers return true.
  virtual bool FitsAlways() const { return false; }
};

}  // namespace Stg

#endif
