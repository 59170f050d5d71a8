// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/nearby.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "motion/separation.hh"

namespace Stg::motion {
namespace {

constexpr size_t kBodiesInPart = 128;
constexpr size_t kFew =
    24;  // so many bodies are compared with each other faster than found by place

double SquaredDistance(Vector p, const WallEdge& edge) {
  const Vector along = edge.ends[1] - edge.ends[0], from = p - edge.ends[0];
  const double square = Dot(along, along);
  const double t = square > 0.0 ? Clamp(Dot(from, along) / square, 0.0, 1.0) : 0.0;
  const Vector distance = from - t * along;
  return Dot(distance, distance);
}

/// Twice the way of a corner that turns, because a body that turns beside something is pushed off
/// by it; and the distance that bodies in contact are pushed apart by.
double WantedReach(const Columns& columns, size_t i, double core) {
  const double dx = columns.target_x[i] - columns.x[i], dy = columns.target_y[i] - columns.y[i];
  const double turn = columns.turn[i];
  if (dx == 0.0 && dy == 0.0 && turn == 0.0) return 0.0;
  return std::sqrt(dx * dx + dy * dy) + 2.0 * Least(std::fabs(turn), 2.0) * core + kSkin;
}

}  // namespace

void Nearby::FindReach(uint32_t i, const Shapes& shapes, const Columns& columns,
                       double least_reach) {
  const Shape& shape = shapes.shapes[columns.shape[i]];
  bound_[i] = shape.bound;
  reach[i] = Most(least_reach, WantedReach(columns, i, shape.core));
  push_[i] = 2.0 * reach[i];
  SetBox(i, columns);
}

void Nearby::SetBox(uint32_t i, const Columns& columns) {
  const double half = bound_[i] + reach[i] + kTouch;
  boxes_[i] = {columns.x[i] - half, columns.y[i] - half, columns.x[i] + half, columns.y[i] + half};
}

void Nearby::TryPair(uint32_t a, uint32_t b, const Columns& columns,
                     std::vector<NearPair>* found) const {
  const double dx = columns.x[a] - columns.x[b], dy = columns.y[a] - columns.y[b];
  // This sum is the same for (a, b) and for (b, a).
  const double far = (bound_[a] + bound_[b]) + (reach[a] + reach[b]) + kTouch;
  if (!(dx * dx + dy * dy < far * far)) return;  // first, because it decides most pairs
  if (!Overlap(boxes_[a], boxes_[b])) return;
  if (reach[a] == 0.0 && reach[b] == 0.0) return;
  if (columns.group[a] == columns.group[b] && columns.group[a] != kNoGroup) return;
  found->push_back(a < b ? NearPair{a, b} : NearPair{b, a});
}

void Nearby::FindWallsOf(uint32_t i, const Walls& edges, const Columns& columns,
                         std::vector<NearPair>* found) const {
  if (reach[i] == 0.0) return;
  const size_t first = found->size();
  const double far = bound_[i] + reach[i] + kTouch;
  edges.ForEachNear(boxes_[i], [&](uint32_t k) {
    const WallEdge& edge = edges.edges()[k];
    if (edge.group == columns.group[i] && edge.group != kNoGroup) return;
    if (SquaredDistance({columns.x[i], columns.y[i]}, edge) < far * far) found->push_back({i, k});
  });
  std::sort(found->begin() + static_cast<std::ptrdiff_t>(first), found->end(),
            [](const NearPair& a, const NearPair& b) { return a.b < b.b; });
}

/// Pairs of a body whose reach has grown: a search with its new box. The others are in the cells of
/// their boxes when the index was filled, so those that have grown as well are searched besides.
void Nearby::FindPairsOf(uint32_t body, const Columns& columns) {
  const auto try_other = [&](uint32_t other) {
    if (other != body) TryPair(body, other, columns, &pairs);
  };
  if (boxes_.size() <= kFew) {
    for (uint32_t other = 0; other < boxes_.size(); other++) try_other(other);
    return;
  }
  index_.ForEachNear(boxes_[body], try_other);
  for (const uint32_t other : queue_) try_other(other);
}

/// Gives pushable bodies the reach of what may push them, until nothing changes. The result is the
/// largest reach that comes to a body along pairs, whatever the order.
void Nearby::SpreadReaches(const Columns& columns) {
  queue_.clear();
  if (std::find(columns.pushable.begin(), columns.pushable.end(), 1) == columns.pushable.end())
    return;
  const auto spread = [&](uint32_t to, uint32_t from) {
    if (!columns.pushable[to] || push_[from] <= push_[to]) return;
    reach[to] = push_[to] = push_[from];
    SetBox(to, columns);
    queue_.push_back(to);
  };
  const auto spread_pairs = [&](size_t first) {
    for (size_t k = first; k < pairs.size(); k++) {
      const NearPair pair = pairs[k];
      spread(pair.a, pair.b);
      spread(pair.b, pair.a);
    }
  };
  spread_pairs(0);
  for (size_t next = 0; next < queue_.size(); next++) {
    // Found again: pairs that were known, which must carry the new reach too.
    const size_t first = pairs.size();
    FindPairsOf(queue_[next], columns);
    spread_pairs(first);
  }
}

/// Sorts the pairs, and drops those that were found again.
void Nearby::SortPairs() {
  const auto order = [](const NearPair& a, const NearPair& b) {
    return a.a != b.a ? a.a < b.a : a.b < b.b;
  };
  std::sort(pairs.begin(), pairs.end(), order);
  const auto equal = [](const NearPair& a, const NearPair& b) { return a.a == b.a && a.b == b.b; };
  pairs.erase(std::unique(pairs.begin(), pairs.end(), equal), pairs.end());
}

uint32_t Nearby::Root(uint32_t body) {
  while (root_[body] != body) body = root_[body] = root_[root_[body]];
  return body;
}

/// Sorts pairs, which ascend, by the islands of their bodies.
void Nearby::SortByIsland(std::vector<NearPair>* of, uint32_t Island::*first,
                          uint32_t Island::*last) {
  const auto island = [this](const NearPair& pair) {
    return island_of_[pair.a] != kNone ? island_of_[pair.a] : island_of_[pair.b];
  };
  count_.assign(islands.size() + 1, 0);
  for (const NearPair& pair : *of) count_[island(pair) + 1]++;
  for (size_t k = 0; k < islands.size(); k++) {
    count_[k + 1] += count_[k];
    islands[k].*first = islands[k].*last = count_[k];
  }
  sorted_.resize(of->size());
  for (const NearPair& pair : *of) sorted_[(islands[island(pair)].*last)++] = pair;
  of->swap(sorted_);
}

/// Bodies that can move and have pairs form islands (union-find, with the smallest member as root).
void Nearby::FormIslands(const Columns& columns) {
  const size_t n = columns.size();
  root_.resize(n);
  place.assign(n, kNone);
  island_of_.assign(n, kNone);
  for (uint32_t i = 0; i < n; i++) root_[i] = i;
  for (const NearPair& pair : pairs) {
    if (reach[pair.a] > 0.0) place[pair.a] = 0;
    if (reach[pair.b] > 0.0) place[pair.b] = 0;
    if (reach[pair.a] == 0.0 || reach[pair.b] == 0.0) continue;
    const uint32_t a = Root(pair.a), b = Root(pair.b);
    root_[a < b ? b : a] = a < b ? a : b;
  }
  for (const NearPair& wall : walls) place[wall.a] = 0;
  islands.clear();
  count_.clear();
  for (uint32_t i = 0; i < n; i++) {
    if (place[i] == kNone) continue;
    const uint32_t root = Root(i);
    if (root == i) {
      island_of_[i] = static_cast<uint32_t>(islands.size());
      islands.push_back({});
    } else {
      island_of_[i] = island_of_[root];
    }
    place[i] = islands[island_of_[i]].last_member++;
  }
  uint32_t sum = 0;
  for (Island& island : islands) {
    island.first_member = sum;
    sum = island.last_member += sum;
  }
  members.resize(sum);
  for (uint32_t i = 0; i < n; i++)
    if (place[i] != kNone) members[islands[island_of_[i]].first_member + place[i]] = i;
}

/// Calls f(body, found) for all bodies, and joins what is found in the order of the bodies.
template <typename F>
void Nearby::Collect(threads::WorkerPool* workers, std::vector<NearPair>* all, F f) {
  const size_t n = boxes_.size();
  const unsigned threads = workers != nullptr ? workers->threads() : 1;
  const size_t parts = std::clamp<size_t>(n / kBodiesInPart, 1, threads > 1 ? 4 * threads : 1);
  if (found_.size() < parts) found_.resize(parts);
  threads::RunOn(workers, parts, 1, [&](size_t begin, size_t end, unsigned) {
    for (size_t part = begin; part < end; part++) {
      found_[part].clear();
      for (size_t i = n * part / parts; i < n * (part + 1) / parts; i++)
        f(static_cast<uint32_t>(i), &found_[part]);
    }
  });
  all->clear();
  for (size_t i = 0; i < parts; i++) all->insert(all->end(), found_[i].begin(), found_[i].end());
}

void Nearby::FindPairs(const Columns& columns, threads::WorkerPool* workers) {
  const size_t n = boxes_.size();
  if (n > kFew) {
    index_.Fill(boxes_, workers);
    return Collect(workers, &pairs, [&](uint32_t body, std::vector<NearPair>* found) {
      index_.ForEachPartner(body, boxes_[body],
                            [&](uint32_t other) { TryPair(body, other, columns, found); });
    });
  }
  pairs.clear();
  for (uint32_t body = 1; body < n; body++)
    for (uint32_t other = 0; other < body; other++) TryPair(body, other, columns, &pairs);
}

void Nearby::Find(const Shapes& shapes, const Walls& edges, const Columns& columns,
                  threads::WorkerPool* workers, double least_reach) {
  const size_t n = columns.size();
  reach.resize(n);
  push_.resize(n);
  bound_.resize(n);
  boxes_.resize(n);
  threads::RunOn(workers, n, kBodiesInPart, [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++)
      FindReach(static_cast<uint32_t>(i), shapes, columns, least_reach);
  });
  FindPairs(columns, workers);
  SpreadReaches(columns);
  if (edges.edges().empty())
    walls.clear();
  else
    Collect(workers, &walls, [&](uint32_t body, std::vector<NearPair>* found) {
      FindWallsOf(body, edges, columns, found);
    });
  if (pairs.empty() && walls.empty()) {
    islands.clear();
    members.clear();
    place.assign(n, kNone);
    return;
  }
  SortPairs();
  FormIslands(columns);
  SortByIsland(&pairs, &Island::first_pair, &Island::last_pair);
  SortByIsland(&walls, &Island::first_wall, &Island::last_wall);
}

}  // namespace Stg::motion
