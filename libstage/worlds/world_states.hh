// SPDX-License-Identifier: GPL-2.0-or-later
//
// States of closed worlds of a pool as words, which clients may store, copy and load into any world
// of a pool with the same scene. A state begins with a head:
//
//   Word 0 is the key of the variant, see WorldStates().
//   Word 1 is the checksum of all other words of the state.
//   Word 2 is the layout of the row, see rows::RowWords.
//   Word 3 is the number of words of the state. Its highest bit says whether the world was
//   reseeded. Word 4 is the number of subscriptions. From word 5 on are the ids of the models that
//   clients have subscribed to, two in a word. The words of the row follow.

#ifndef STAGE_WORLDS_WORLD_STATES_HH
#define STAGE_WORLDS_WORLD_STATES_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "worlds/world_pool.hh"

namespace Stg {

class Subscriptions;

/// Thrown if a world has no such state, or if a state does not fit.
struct StateError {
  std::string why;
};

class WorldStates {
 public:
  using Ids = WorldPool::Ids;

  /// `keys`: for each variant a hash of all that its worlds are loaded with, except for the texts
  /// of files.
  WorldStates(WorldPool* pool, std::vector<uint64_t> keys) : pool_(*pool), keys_(std::move(keys)) {}

  /// Words of the longest state of these worlds. Throws StateError if one of them has none.
  size_t CountWords(const Ids& ids);
  /// Writes `width` words for each of these worlds; they follow CountWords().
  void Save(const Ids& ids, size_t width, uint64_t* to);
  /// Puts worlds into states of `width` words each, and makes them worlds of the variants of these.
  /// Throws StateError, and changes nothing, if a state does not fit. `shares_scene`: all worlds
  /// must have the same variant and subscriptions afterwards, as their arrays are on a device.
  void Load(const Ids& ids, size_t width, const uint64_t* from, bool shares_scene = false);

 private:
  class Format;
  /// Where a state belongs.
  struct Target {
    uint32_t variant;
    Subscriptions* subscriptions;
  };
  void ForEachBlock(size_t count, const std::function<void(size_t begin, size_t end)>& job);
  Subscriptions* Require(uint32_t id);
  void Use(uint32_t id, Format* format);
  uint64_t KeyOf(uint32_t variant);
  uint32_t FindVariant(uint64_t key, uint32_t first);
  void Check(const uint64_t* state, size_t width, Format* format, Target* target);
  void CheckSharedScene(const Ids& ids, const std::vector<Target>& targets);
  void ChangeVariants(const Ids& ids, const std::vector<Target>& targets);

  WorldPool& pool_;
  const std::vector<uint64_t> keys_;  // by variant
  std::once_flag listing_;
  std::unordered_map<uint64_t, uint32_t> variants_;  // by key; listed when it is needed
};

}  // namespace Stg

#endif
