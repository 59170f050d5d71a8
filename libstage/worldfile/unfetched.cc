// SPDX-License-Identifier: GPL-2.0-or-later
#include <algorithm>
#include <numeric>
#include <vector>

#include "worldfile/worldfile_impl.hh"

namespace Stg::worldfile {
namespace {

// Visits the properties of all entities. A property that is fetched, or reported as unfetched, is
// removed from the list of its body, so that other entities sharing the body skip it. A property
// that is overridden in an entity stays on the list.
class Search {
 public:
  Search(const Document& document, const std::vector<bool>& fetched)
      : document_(document), fetched_(fetched), left_(document.properties.size()) {
    std::iota(left_.begin(), left_.end(), 0U);
    for (const Body& body : document.bodies) left_count_.push_back(body.property_count);
  }

  std::vector<Unfetched> Run() {
    for (std::uint32_t entity = 0; entity < document_.entities.size(); ++entity) {
      VisitBody(entity, document_.entities[entity].body);
      for (const std::uint32_t macro : document_.chains[document_.entities[entity].chain].macros) {
        VisitBody(entity, document_.macros[macro].body);
      }
      if (overridden_ > kMaxOverridden) break;
    }
    std::sort(found_.begin(), found_.end(), [&](const Unfetched& a, const Unfetched& b) {
      return document_.properties[a.property].name_token <
             document_.properties[b.property].name_token;
    });
    if (found_.size() > kMaxWarnings) found_.resize(kMaxWarnings);
    return std::move(found_);
  }

 private:
  // Bounds the work. Reached only by hostile files, with thousands of entities that override all
  // properties of their macros.
  static constexpr std::size_t kMaxOverridden = 5'000'000;

  void VisitBody(std::uint32_t entity, std::uint32_t body) {
    std::uint32_t& count = left_count_[body];
    const std::size_t first = document_.bodies[body].first_property;
    for (std::uint32_t i = 0; i < count;) {
      const std::uint32_t number = left_[first + i];
      const Property& property = document_.properties[number];
      const bool is_fetched = property.used != 0 || fetched_[number];
      if (!is_fetched && document_.Find(entity, property.name) != number) {
        ++overridden_;
        ++i;
        continue;
      }
      if (!is_fetched) found_.push_back({number, entity});
      left_[first + i] = left_[first + --count];
    }
  }

  const Document& document_;
  const std::vector<bool>& fetched_;
  std::vector<std::uint32_t> left_;        // property numbers, grouped by body
  std::vector<std::uint32_t> left_count_;  // remaining properties of each body
  std::size_t overridden_ = 0;
  std::vector<Unfetched> found_;
};

}  // namespace

std::vector<Unfetched> FindUnfetched(const Document& document, const std::vector<bool>& fetched) {
  return Search(document, fetched).Run();
}

}  // namespace Stg::worldfile
