// SPDX-License-Identifier: GPL-2.0-or-later
#include <algorithm>
#include <string>
#include <vector>

#include "worldfile/worldfile_impl.hh"

namespace Stg::worldfile {
namespace {

// Optimal string alignment distance: the number of letters to insert, remove, replace or swap with
// a neighbour.
std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({replaced, last[j] + 1, row[j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

// Maximum edit distance. Smaller for short names, which would otherwise match any other.
std::size_t MaxMistakes(const std::string& name) {
  if (name.size() < 3) return 0;
  return name.size() < 6 ? 1 : 2;
}

// The part before an index: "point" for "point[3]".
std::string Stem(const std::string& name) { return name.substr(0, name.find('[')); }

}  // namespace

std::string WithoutIndices(std::string_view name) {
  std::string family;
  bool in_index = false;
  for (const char c : name) {
    if (c == ']') in_index = false;
    if (!in_index) family += c;
    if (c == '[') in_index = true;
  }
  return family;
}

std::string FindSimilar(const std::string& name, const std::vector<std::string>& candidates) {
  std::size_t best = MaxMistakes(name) + 1;
  std::string similar;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = EditDistance(name, candidate);
    if (distance >= best) continue;
    best = distance;
    similar = candidate;
  }
  return similar;
}

NameAdviser::NameAdviser(const Document& document, const std::vector<bool>& asked)
    : document_(document), asked_(asked) {
  for (std::uint32_t name = 0; name < asked.size(); ++name) {
    if (asked[name] && MaxMistakes(document.names.Text(name)) > 0) candidates_.push_back(name);
  }
}

std::string NameAdviser::SimilarName(std::uint32_t entity, std::uint32_t name) const {
  if (name < asked_.size() && asked_[name]) return "";
  const std::string& text = document_.names.Text(name);
  std::size_t best = MaxMistakes(text) + 1;
  std::string similar;
  for (const std::uint32_t other : candidates_) {
    const std::string& candidate = document_.names.Text(other);
    const std::size_t longer = std::max(candidate.size(), text.size());
    if (longer - std::min(candidate.size(), text.size()) >= best) continue;
    const bool indexed = text.find('[') != std::string::npos;
    // point[9] is an additional point, not a misspelt point[8].
    if (indexed && Stem(candidate) == Stem(text)) continue;
    if (document_.Find(entity, other) != kNone) continue;
    const std::size_t distance = EditDistance(text, candidate);
    // Ties are resolved alphabetically.
    if (distance < best || (distance == best && !similar.empty() && candidate < similar)) {
      best = distance;
      similar = candidate;
    }
  }
  return similar;
}

}  // namespace Stg::worldfile
