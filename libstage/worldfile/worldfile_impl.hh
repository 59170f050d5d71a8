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

/// New values of a property; unchanged ones are empty.
using Written = std::vector<std::optional<std::string>>;

/// Text of the world file with the written values (see Worldfile::Save()). Warns about changes that
/// cannot be expressed.
std::string SavedText(Document& document, const std::vector<Population>& populations,
                      const std::map<Slot, Written>& written);

/// The candidate most similar to the name, or "" if none is close.
std::string FindSimilar(const std::string& name, const std::vector<std::string>& candidates);

/// Removes numbers in indices: `polygon[3].point[0]` becomes `polygon[].point[]`.
std::string WithoutIndices(std::string_view name);

/// Suggests names for misspelt ones.
class NameAdviser {
 public:
  /// `asked[name]`: some reader has asked for the name.
  NameAdviser(const Document& document, const std::vector<bool>& asked);

  /// Returns the most similar name that some reader has asked for and that the entity lacks, or "".
  std::string SimilarName(std::uint32_t entity, std::uint32_t name) const;

 private:
  const Document& document_;
  const std::vector<bool>& asked_;
  std::vector<std::uint32_t> candidates_;
};

/// A property that no reader fetched, and an entity that has it.
struct Unfetched {
  std::uint32_t property;
  std::uint32_t entity;
};

/// Finds properties that are neither marked as used nor in `fetched`, in file order without
/// duplicates, up to kMaxWarnings.
std::vector<Unfetched> FindUnfetched(const Document& document, const std::vector<bool>& fetched);

}  // namespace worldfile

struct Worldfile::Impl {
  worldfile::Document document;
  std::string base_directory;
  std::map<worldfile::Slot, worldfile::Written> written;
  std::vector<bool> asked;  // by name: some reader has asked for it
  std::map<worldfile::Slot, std::unique_ptr<CProperty>> handles;
  std::unordered_set<std::string> kept_strings;  // owns the results of type const char*
  std::vector<Population> populations;
  std::uint32_t files = 0;  // number of sources that are files; later ones are settings and
                            // populations
  int written_count = 0;    // entities that were not added after loading
  std::unordered_set<std::string> included;  // files that were read after loading
  std::size_t warnings_printed = 0;

  std::uint32_t InternAsked(const char* name);
  std::string_view Value(int entity, int property, std::size_t index) const;
};

}  // namespace Stg

#endif
