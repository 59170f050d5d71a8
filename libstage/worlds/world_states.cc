// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/world_states.hh"

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>

#include "random/random.hh"
#include "rows/row_words.hh"
#include "worlds/pool_access.hh"
#include "worlds/pool_scene.hh"

namespace Stg {

namespace {

constexpr size_t kHead = 5;
constexpr uint64_t kReseeded = uint64_t{1} << 63;

/// Several sums side by side, because one would wait for a product in each step.
uint64_t ChecksumOf(const uint64_t* words, size_t count) {
  constexpr size_t kLanes = 4;
  constexpr uint64_t kFactor = 0x9e3779b97f4a7c15u;
  uint64_t sums[kLanes] = {1, 2, 3, 4};
  const auto add = [](uint64_t sum, uint64_t word) {
    const uint64_t product = (sum ^ word) * kFactor;
    return product ^ (product >> 32);
  };
  size_t i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (size_t lane = 0; lane < kLanes; lane++) sums[lane] = add(sums[lane], words[i + lane]);
  for (; i < count; i++) sums[0] = add(sums[0], words[i]);
  uint64_t all = count;
  for (const uint64_t sum : sums) all = add(all, sum);
  return all;
}

/// The checksum of a state: of all words but its own place.
uint64_t ChecksumOfState(const uint64_t* state, size_t count) {
  return MixSeeds(ChecksumOf(state + 2, count - 2), state[0]);
}

}  // namespace

/// How states with certain subscriptions are stored. One is used as long as they stay the same.
class WorldStates::Format {
 public:
  void Use(uint32_t variant, Subscriptions* subscriptions, uint64_t key) {
    if (subscriptions == subscriptions_) return;
    subscriptions_ = subscriptions;
    variant_ = variant;
    key_ = key;
    row_ = std::make_unique<rows::RowWords>(*subscriptions->scene());
    ids_.assign((models().size() + 1) / 2, 0);
    if (!ids_.empty())
      std::memcpy(ids_.data(), models().data(), models().size() * sizeof(uint32_t));
  }
  /// True if a valid state is stored like this.
  bool IsOf(uint32_t variant, const uint64_t* state) const {
    return subscriptions_ && variant_ == variant && key_ == state[0] &&
           models().size() == state[4] && std::equal(ids_.begin(), ids_.end(), state + kHead);
  }
  Subscriptions* subscriptions() const { return subscriptions_; }
  const rows::RowWords& row() const { return *row_; }
  size_t before_row() const { return kHead + ids_.size(); }
  size_t Count(bool reseeded) const { return before_row() + row_->Count(reseeded); }

  /// Returns the number of words.
  size_t Save(const PoolRow& from, uint64_t* to) const {
    const bool reseeded = rows::RowWords::IsReseeded(*from.rows, from.row);
    const size_t count = Count(reseeded);
    to[0] = key_;
    to[2] = row_->layout();
    to[3] = count | (reseeded ? kReseeded : 0);
    to[4] = models().size();
    std::copy(ids_.begin(), ids_.end(), to + kHead);
    row_->Save(*from.rows, from.row, to + before_row());
    to[1] = ChecksumOfState(to, count);
    return count;
  }
  void Load(const uint64_t* from, const PoolRow& to) const {
    row_->Load(from + before_row(), from[3] & kReseeded, to.rows, to.row);
  }

 private:
  const std::vector<uint32_t>& models() const { return subscriptions_->models(); }

  Subscriptions* subscriptions_ = nullptr;
  uint32_t variant_ = 0;
  uint64_t key_ = 0;
  std::unique_ptr<rows::RowWords> row_;
  std::vector<uint64_t> ids_;
};

/// The key in the states of worlds of a variant that has rows.
uint64_t WorldStates::KeyOf(uint32_t variant) {
  return MixSeeds(keys_[variant], PoolAccess::HashOfFiles(pool_, variant));
}

/// The variant with a key: `first` if it has this one. Throws StateError if there is none.
uint32_t WorldStates::FindVariant(uint64_t key, uint32_t first) {
  if (PoolAccess::WhyNoRows(pool_, first).empty() && KeyOf(first) == key) return first;
  std::call_once(listing_, [this] {
    for (uint32_t variant = 0; variant < keys_.size(); variant++)
      if (PoolAccess::WhyNoRows(pool_, variant).empty()) variants_.emplace(KeyOf(variant), variant);
  });
  const auto known = variants_.find(key);
  if (known != variants_.end()) return known->second;
  throw StateError{
      "it is of another scene: no variant of this batch has its world file, options "
      "and values of vary()"};
}

/// Calls job(begin, end) for parts of 0 to count - 1, on all threads.
void WorldStates::ForEachBlock(size_t count, const std::function<void(size_t, size_t)>& job) {
  constexpr size_t kBlock = 64;
  pool_.Run((count + kBlock - 1) / kBlock, [&](size_t block, unsigned) {
    job(block * kBlock, std::min(count, (block + 1) * kBlock));
  });
}

/// The subscriptions of a world whose state can be saved.
Subscriptions* WorldStates::Require(uint32_t id) {
  const std::string world = "world " + std::to_string(id);
  if (!pool_.Failure(id).empty()) throw StateError{world + " has failed: " + pool_.Failure(id)};
  if (Subscriptions* const found = PoolAccess::SubscriptionsOf(pool_, id)) return found;
  const std::string reason = pool_.WhyNotClosed(id);
  throw StateError{world + " has no state as an array, because " +
                   (reason.empty() ? "it was changed since its last step; make a step first"
                                   : reason + "; use snapshot()")};
}

void WorldStates::Use(uint32_t id, Format* format) {
  Subscriptions* const subscriptions = Require(id);  // there are rows, so there is a key
  const uint32_t variant = pool_.Variant(id);
  format->Use(variant, subscriptions, KeyOf(variant));
}

size_t WorldStates::CountWords(const Ids& ids) {
  std::vector<size_t> counts(ids.size());
  ForEachBlock(ids.size(), [&](size_t begin, size_t end) {
    Format format;
    for (size_t i = begin; i < end; i++) {
      Use(ids[i], &format);
      counts[i] = format.Count(PoolAccess::IsReseeded(pool_, ids[i]));
    }
  });
  return counts.empty() ? kHead : std::ranges::max(counts);
}

void WorldStates::Save(const Ids& ids, size_t width, uint64_t* to) {
  ForEachBlock(ids.size(), [&](size_t begin, size_t end) {
    Format format;
    for (size_t i = begin; i < end; i++) {
      Use(ids[i], &format);
      const PoolRow row = PoolAccess::RowToRead(pool_, ids[i]);
      if (!row) throw StateError{"world " + std::to_string(ids[i]) + " can't be made"};
      uint64_t* const state = to + i * width;
      const size_t used = format.Save(row, state);
      STAGE_ASSERT(used <= width);
      std::fill(state + used, state + width, 0);
    }
  });
}

/// Finds out where a state belongs. Throws StateError if it fits nowhere. The target has the
/// variant that is preferred if several are equal.
void WorldStates::Check(const uint64_t* state, size_t width, Format* format, Target* target) {
  const uint64_t count = width >= kHead ? state[3] & ~kReseeded : 0;
  if (count < kHead || count > width || state[1] != ChecksumOfState(state, count))
    throw StateError{"it was changed or cut off, or is none"};
  target->variant = FindVariant(state[0], target->variant);
  if (!format->IsOf(target->variant, state)) {
    std::vector<uint32_t> models(state[4]);
    if (!models.empty())
      std::memcpy(models.data(), state + kHead, models.size() * sizeof(uint32_t));
    std::string reason;
    Subscriptions* const found =
        PoolAccess::FindSubscriptions(pool_, target->variant, models, &reason);
    if (!found) throw StateError{"worlds with its sensors are not closed: " + reason};
    format->Use(target->variant, found, state[0]);
  }
  target->subscriptions = format->subscriptions();
  if (state[2] != format->row().layout() || count != format->Count(state[3] & kReseeded))
    throw StateError{"it was made by another version of Stage"};
}

/// Throws StateError if all worlds would not share a scene with their new states.
void WorldStates::CheckSharedScene(const Ids& ids, const std::vector<Target>& targets) {
  if (ids.empty()) return;
  const auto differs = [&](const Target& target) {
    return target.subscriptions != targets[0].subscriptions;
  };
  const bool others_differ =
      ids.size() < pool_.size() && std::ranges::any_of(pool_.All(), [&](uint32_t id) {
        return PoolAccess::SubscriptionsOf(pool_, id) != targets[0].subscriptions;
      });
  if (others_differ || std::ranges::any_of(targets, differs))
    throw StateError{
        "worlds on a device have the same sensors in use and the same properties that vary: load "
        "states that have these in common in all worlds at once"};
}

/// Makes worlds those of the variants of their new states. They get places there in their order.
void WorldStates::ChangeVariants(const Ids& ids, const std::vector<Target>& targets) {
  std::map<uint32_t, uint32_t> changed;
  for (size_t i = 0; i < ids.size(); i++)
    if (targets[i].variant != pool_.Variant(ids[i])) changed[ids[i]] = targets[i].variant;
  if (changed.empty()) return;
  Ids worlds;
  std::vector<uint32_t> variants;
  std::vector<uint64_t> seeds;
  for (const auto& [id, variant] : changed) {
    worlds.push_back(id);
    variants.push_back(variant);
    seeds.push_back(pool_.seeds()[id]);
  }
  pool_.Reset(worlds, seeds, variants);
}

void WorldStates::Load(const Ids& ids, size_t width, const uint64_t* from, bool shares_scene) {
  std::vector<Target> targets(ids.size());
  ForEachBlock(ids.size(), [&](size_t begin, size_t end) {
    Format format;
    for (size_t i = begin; i < end; i++) {
      targets[i].variant = pool_.Variant(ids[i]);
      try {
        Check(from + i * width, width, &format, &targets[i]);
      } catch (const StateError& error) {
        throw StateError{"state " + std::to_string(i) + " doesn't fit, because " + error.why};
      }
      if (!PoolAccess::CanEnter(pool_, ids[i]))
        throw StateError{"world " + std::to_string(ids[i]) + " takes no state, because " +
                         pool_.WhyNotClosed(ids[i]) + "; use restore()"};
    }
  });
  if (shares_scene) CheckSharedScene(ids, targets);
  ChangeVariants(ids, targets);
  ForEachBlock(ids.size(), [&](size_t begin, size_t end) {
    Format format;
    for (size_t i = begin; i < end; i++) {
      format.Use(targets[i].variant, targets[i].subscriptions, 0);
      format.Load(from + i * width, PoolAccess::Enter(pool_, ids[i], targets[i].subscriptions));
    }
  });
}

}  // namespace Stg
