// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/row_words.hh"

#include <cstring>
#include <memory>
#include <type_traits>

#include "messages/assert.hh"
#include "random/fnv1a.hh"
#include "rows/each_column.hh"
#include "world/engine.hh"

namespace Stg::rows {

namespace {

/// Incremented when the meaning of the words changes.
constexpr uint64_t kVersion = 1;

using Fiducial = ModelFiducial::Fiducial;

/// Words that `count` elements take. Elements that are listed here are stored member by member,
/// because they have padding, which is undefined, or virtual functions.
template <typename T>
constexpr size_t WordsFor(size_t count) {
  if constexpr (std::is_same_v<T, Bump>) return 3 * count;
  if constexpr (std::is_same_v<T, Fiducial>) return 11 * count;
  if constexpr (std::is_same_v<T, NoisyOdometry>) return 20 * count;
  if constexpr (std::is_same_v<T, std::shared_ptr<const Reseeding>>) return 0;  // follows all
  return (count * sizeof(T) + 7) / 8;
}

/// Calls x(member, 1) for the members of an element.
template <typename X>
void ExchangeMembers(X* x, Bump* bump) {
  (*x)(&bump->model, 1);
  (*x)(&bump->x, 1);
  (*x)(&bump->y, 1);
}

template <typename X>
void ExchangeMembers(X* x, Pose* pose) {
  for (double* const member : {&pose->x, &pose->y, &pose->z, &pose->a}) (*x)(member, 1);
}

template <typename X>
void ExchangeMembers(X* x, Fiducial* seen) {
  (*x)(&seen->range, 1);
  (*x)(&seen->bearing, 1);
  ExchangeMembers(x, &seen->geom);
  ExchangeMembers(x, &seen->pose);
  (*x)(&seen->id, 1);
}

/// The interface that NoisyOdometry::ExchangeState() expects.
template <typename X>
struct MemberExchange {
  void Exchange(Pose* pose) { ExchangeMembers(x, pose); }
  void Exchange(PoseCovariance* covariance) { (*x)(covariance, 1); }
  void Exchange(double* number) { (*x)(number, 1); }
  template <typename... Members>
  void operator()(Members&... members) {
    (Exchange(&members), ...);
  }

  X* x;
};

template <typename X>
void ExchangeMembers(X* x, NoisyOdometry* odometry) {
  MemberExchange<X> exchange{x};
  odometry->ExchangeState(exchange);
}

template <typename T>
constexpr bool kIsPlain = std::is_trivially_copyable_v<T> && !std::is_same_v<T, Bump>;

/// Writes words one after the other.
class Writer {
 public:
  explicit Writer(uint64_t* to) : to_(to) {}

  template <typename T>
  void operator()(const T* from, size_t count) {
    if constexpr (kIsPlain<T>) {
      if (count == 0) return;
      const size_t words = WordsFor<T>(count);
      to_[words - 1] = 0;
      std::memcpy(to_, from, count * sizeof(T));
      to_ += words;
    } else {
      for (size_t i = 0; i < count; i++) {
        T element = from[i];
        ExchangeMembers(this, &element);
      }
    }
  }
  void operator()(const std::shared_ptr<const Reseeding>*, size_t) {}
  const uint64_t* end() const { return to_; }

 private:
  uint64_t* to_;
};

/// Reads words one after the other.
class Reader {
 public:
  explicit Reader(const uint64_t* from) : from_(from) {}

  template <typename T>
  void operator()(T* to, size_t count) {
    if constexpr (kIsPlain<T>) {
      if (count > 0) std::memcpy(static_cast<void*>(to), from_, count * sizeof(T));
      from_ += WordsFor<T>(count);
    } else {
      for (size_t i = 0; i < count; i++) ExchangeMembers(this, &to[i]);
    }
  }
  void operator()(std::shared_ptr<const Reseeding>* to, size_t) { to->reset(); }

 private:
  const uint64_t* from_;
};

/// Calls f(elements, count) for the parts of a reseeding, which both have room for the scene's.
template <typename F, typename R>
void ForEachPart(R* reseeding, F* f) {
  (*f)(&reseeding->loading_seed, 1);
  (*f)(reseeding->models.data(), reseeding->models.size());
  (*f)(reseeding->sensors.data(), reseeding->sensors.size());
  (*f)(reseeding->had_readings.data(), reseeding->had_readings.size());
  (*f)(reseeding->update.data(), reseeding->update.size());
}

}  // namespace

RowWords::RowWords(const Scene& scene)
    : scene_(scene),
      layout_(Fnv1aStep(kFnv1aStart, kVersion)),
      models_(scene.prototype->engine().models.size()) {
  Columns columns;
  ForEachColumn(
      scene,
      [&](size_t count, auto* column) {
        using T = std::remove_cvref_t<decltype((*column)[0])>;
        layout_ = Fnv1aStep(Fnv1aStep(layout_, count), sizeof(T));
        count_ += WordsFor<T>(count);
      },
      &columns);
  reseeding_count_ = 1 + WordsFor<uint64_t>(models_) +
                     WordsFor<RandomStream>(scene.sensors.size()) +
                     WordsFor<uint8_t>(scene.rates.size()) + WordsFor<usec_t>(scene.rates.size());
  layout_ = Fnv1aStep(layout_, models_);
}

void RowWords::Save(const Rows& rows, size_t world, uint64_t* to) const {
  STAGE_ASSERT(&rows.scene() == &scene_ && world < rows.size());
  Writer writer(to);
  ForEachColumn(
      scene_,
      [&](size_t count, const auto* column) { writer(column->data() + world * count, count); },
      &rows.columns);
  const Reseeding* const reseeding = rows.columns.reseeding[world].get();
  STAGE_ASSERT(writer.end() == to + Count(false));
  if (!reseeding) return;
  STAGE_ASSERT(reseeding->models.size() == models_ &&
               reseeding->sensors.size() == scene_.sensors.size() &&
               reseeding->update.size() == scene_.rates.size());
  ForEachPart(reseeding, &writer);
  STAGE_ASSERT(writer.end() == to + Count(true));
}

void RowWords::Load(const uint64_t* from, bool reseeded, Rows* rows, size_t world) const {
  STAGE_ASSERT(&rows->scene() == &scene_ && world < rows->size());
  Reader reader(from);
  ForEachColumn(
      scene_, [&](size_t count, auto* column) { reader(column->data() + world * count, count); },
      &rows->columns);
  if (!reseeded) return;
  auto reseeding = std::make_shared<Reseeding>();
  reseeding->models.resize(models_);
  reseeding->sensors.resize(scene_.sensors.size());
  reseeding->had_readings.resize(scene_.rates.size());
  reseeding->update.resize(scene_.rates.size());
  ForEachPart(reseeding.get(), &reader);
  rows->columns.reseeding[world] = std::move(reseeding);
}

}  // namespace Stg::rows
