// SPDX-License-Identifier: GPL-2.0-or-later
//
// Maps names to models.

#ifndef STAGE_MODELS_MODEL_NAMES_HH
#define STAGE_MODELS_MODEL_NAMES_HH

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>

namespace Stg {

class Model;
class Host;

/// Present and former names of a world's models. Stores model ids; entries of deleted models find
/// nothing and are removed in batches.
class ModelNames {
 public:
  /// Assigns the name to the model, replacing any earlier owner.
  void Add(const Model* model, const std::string& name);
  /// Returns null if no model of the host has the name.
  Model* Find(const std::string& name, const Host& host) const;
  /// Call it after a model has been removed from the host.
  void NoteRemoved(const Host& host);
  /// Drops names of deleted models. Call it before their ids are used again.
  void RemoveStale(const Host& host);
  void Clear();
  /// Calls f(std::string, uint32_t id) for all names in alphabetical order.
  template <typename F>
  void ForEach(F f) const {
    for (const auto& [name, id] : std::map<std::string, uint32_t>(ids_.begin(), ids_.end()))
      f(name, id);
  }

  std::size_t size() const { return ids_.size(); }
  /// Counts changes of names.
  uint64_t version() const { return version_; }
  /// Number of names examined in removing entries; a measure of the work.
  uint64_t looked_at() const { return looked_at_; }

 private:
  std::unordered_map<std::string, uint32_t> ids_;
  uint64_t version_ = 0;
  std::size_t removed_ = 0;  // models removed since the last cleanup
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
