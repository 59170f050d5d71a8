// SPDX-License-Identifier: GPL-2.0-or-later
//
// The arrays of a crowd need to know about rows which mover each robot is, and data that are found
// once for each scene.

#ifndef STAGE_PYTHON_ROW_CROWD_HH
#define STAGE_PYTHON_ROW_CROWD_HH

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "rows/scene.hh"
#include "worlds/pool_access.hh"

namespace Stg {
class ModelPosition;
struct ModelType;
}  // namespace Stg

namespace Stg::python {

/// A value for each scene. Several threads may look up values at once.
template <typename T>
class ByScene {
 public:
  ByScene() = default;
  ByScene(const ByScene&) = delete;
  ByScene& operator=(const ByScene&) = delete;
  ~ByScene() { Clear(); }

  /// Forgets all values. No other thread may call anything meanwhile.
  void Clear() {
    for (std::atomic<Entry*>& bucket : buckets_)
      for (Entry* entry = bucket.exchange(nullptr); entry;)
        delete std::exchange(entry, entry->next);
  }

  /// The value of a scene; made by make() the first time. Call Clear() before a scene is deleted.
  template <typename F>
  const T& Get(const rows::Scene& scene, F make) {
    if (const T* const known = Find(scene)) return *known;
    const std::lock_guard lock(mutex_);
    if (const T* const known = Find(scene)) return *known;
    std::atomic<Entry*>& bucket = buckets_[BucketOf(scene)];
    Entry* const entry = new Entry{&scene, make(), bucket};
    bucket.store(entry, std::memory_order_release);
    return entry->value;
  }

 private:
  struct Entry {
    const rows::Scene* scene;
    T value;
    Entry* next;
  };
  static constexpr size_t kBuckets = 128;  // for the scenes of a hundred variants
  static size_t BucketOf(const rows::Scene& scene) {
    const auto place = static_cast<uint64_t>(reinterpret_cast<uintptr_t>(&scene));
    return static_cast<size_t>((place >> 4) * 0x9e3779b97f4a7c15u >> 32) % kBuckets;
  }
  const T* Find(const rows::Scene& scene) const {
    const Entry* entry = buckets_[BucketOf(scene)].load(std::memory_order_acquire);
    for (; entry; entry = entry->next)
      if (entry->scene == &scene) return &entry->value;
    return nullptr;
  }

  std::array<std::atomic<Entry*>, kBuckets> buckets_{};
  std::mutex mutex_;
};

/// The robots of a crowd in a scene.
struct RowRobots {
  static constexpr uint32_t kNone = UINT32_MAX;
  const rows::Scene* scene;
  std::vector<const ModelPosition*> models;  ///< of the prototype; null: it does not exist
  std::vector<uint32_t> movers;              ///< or kNone
  bool follow_each_other;                    ///< all are movers, each the next one
  bool run;                                  ///< all that exist have subscribers
};

/// A world in a row.
struct RowOfCrowd {
  const rows::Rows& rows;
  size_t row;
  const RowRobots& robots;
};

/// Where the readings of a sensor are in rows of a scene: rays of a ranger, lines of a bumper, or
/// the number of another finder.
struct SensorOfRow {
  const Model* model = nullptr;  ///< of the prototype; null: the robot has none
  uint32_t first = 0, count = 0;
  uint32_t rate = 0;  ///< in Scene::rates
};

/// Finds sensor number `index` of a type in the tree of a robot of the prototype, which may be
/// null.
SensorOfRow FindSensorOfRow(const rows::Scene& scene, const ModelPosition* robot,
                            const ModelType& type, size_t index);

/// How a group of arrays is filled from rows of a scene.
struct RowPlan {
  bool possible = false;
  std::vector<uint32_t> needs;  ///< ids of models that must run, but do not yet
};

}  // namespace Stg::python

#endif
