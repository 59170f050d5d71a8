// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_WORLDFILE_IMPL_HH
#define STAGE_WORLDFILE_WORLDFILE_IMPL_HH

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "worldfile/document.hh"
#include "worldfile/worldfile.hh"

namespace Stg {
namespace worldfile {

/// An entity and the name of a property.
using Slot = std::pair<std::uint32_t, std::uint32_t>;

/// New values of a property, those that were written.
using Written = std::vector<std::optional<std::string>>;

/// The text of the world file with what was written in its place (see Worldfile::Save). Adds a
/// warning for what cannot be expressed.
std::string SavedText(Document& document, const std::vector<Population>& populations,
                      const std::map<Slot, Written>& written);

/// The candidate that the name may have been meant to be, or "".
std::string MostSimilar(const std::string& name, const std::vector<std::string>& candidates);

/// `polygon[3].point[0]` is one of a family of properties: `polygon[].point[]`.
std::string WithoutIndices(std::string_view name);

/// Tells what names may have been meant.
class NameAdviser {
 public:
  /// `asked`, by name: somebody asked for it.
  NameAdviser(const Document& document, const std::vector<bool>& asked);

  /// The name that a property's name may have been meant to be, or "". It is one of those that
  /// somebody asked for, and none that the entity has anyway.
  std::string SimilarName(std::uint32_t entity, std::uint32_t name) const;

 private:
  const Document& document_;
  const std::vector<bool>& asked_;
  std::vector<std::uint32_t> candidates_;
};

/// A property that nobody fetched, and an entity that has it.
struct Unfetched {
  std::uint32_t property;
  std::uint32_t entity;
};

/// Those that are neither marked as used nor in `fetched`, in file order, each once; kMaxWarnings
/// of them at most.
std::vector<Unfetched> FindUnfetched(const Document& document, const std::vector<bool>& fetched);

}  // namespace worldfile

struct Worldfile::Impl {
  worldfile::Document document;
  std::string base_directory;
  std::map<worldfile::Slot, worldfile::Written> written;
  std::vector<bool> asked;  // by name: somebody looked for a property of that name
  std::map<worldfile::Slot, std::unique_ptr<CProperty>> handles;
  std::unordered_set<std::string> kept_strings;  // what const char* results point to
  std::vector<Population> populations;
  std::uint32_t files = 0;  // of the document's sources; the rest are settings and the like
  std::size_t warnings_printed = 0;

  std::uint32_t AskedName(const char* name);
  std::string_view Value(int entity, int property, std::size_t index) const;
};

}  // namespace Stg

#endif
