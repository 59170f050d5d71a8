// SPDX-License-Identifier: GPL-2.0-or-later
//
// Which model has which name.

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

/// The names that the models of a world have and have had. Models are kept by number: what names a
/// model that is gone finds nobody, and is swept out with many others.
class ModelNames {
 public:
  /// The name is the model's from now on, whoever had it before.
  void Add(const Model* model, const std::string& name);
  /// Null if no model of the host's has it.
  Model* Find(const std::string& name, const Host& host) const;
  /// To be called when a model has been taken out of the host's.
  void NoteRemoved(const Host& host);
  /// Drops names of models that are gone: from here on others may have their numbers.
  void DropRemoved(const Host& host);
  void Clear();
  /// Calls f(std::string, uint32_t id) for all, in alphabetical order.
  template <typename F>
  void ForEach(F f) const {
    for (const auto& [name, id] : std::map<std::string, uint32_t>(ids_.begin(), ids_.end()))
      f(name, id);
  }

  std::size_t size() const { return ids_.size(); }
  /// How many names were looked at to sweep: the work that removed models have made.
  uint64_t looked_at() const { return looked_at_; }

 private:
  std::unordered_map<std::string, uint32_t> ids_;
  std::size_t removed_ = 0;  // models, since the last sweep
  uint64_t looked_at_ = 0;
};

}  // namespace Stg

#endif
