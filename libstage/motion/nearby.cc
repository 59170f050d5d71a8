// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/nearby.hh"

#include <algorithm>

#include "messages/assert.hh"
#include "motion/separation.hh"

namespace Stg::motion {
namespace {

// Bodies that cover more cells are compared with all others instead.
constexpr int64_t kMostCells = 64;

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

void Nearby::FindReaches(const Shapes& shapes, const Columns& columns, double least_reach) {
  const size_t n = columns.size();
  reach.resize(n);
  push_.resize(n);
  bound_.resize(n);
  boxes_.resize(n);
  double sum = 0.0;
  for (uint32_t i = 0; i < n; i++) {
    const Shape& shape = shapes.shapes[columns.shape[i]];
    bound_[i] = shape.bound;
    reach[i] = Most(least_reach, WantedReach(columns, i, shape.core));
    push_[i] = 2.0 * reach[i];
    SetBox(i, columns);
    sum += boxes_[i].x1 - boxes_[i].x0;
  }
  cell_ = n > 0 ? 1.5 * sum / static_cast<double>(n) : 1.0;
}

void Nearby::SetBox(uint32_t i, const Columns& columns) {
  const double half = bound_[i] + reach[i] + kTouch;
  boxes_[i] = {columns.x[i] - half, columns.y[i] - half, columns.x[i] + half, columns.y[i] + half};
}

Nearby::CellRange Nearby::CellsOf(const Box& box) const {
  const auto cell = [this](double position) {
    constexpr double kFar = 1e9;
    const double quotient = Clamp(position / cell_, -kFar, kFar);
    const int32_t truncated = static_cast<int32_t>(quotient);
    return truncated - (static_cast<double>(truncated) > quotient ? 1 : 0);
  };
  return {cell(box.x0), cell(box.y0), cell(box.x1), cell(box.y1)};
}

size_t Nearby::BucketOf(int32_t x, int32_t y) const {
  const uint32_t hash =
      static_cast<uint32_t>(x) * 0x9e3779b1u + static_cast<uint32_t>(y) * 0x85ebca77u;
  return (hash ^ (hash >> 15)) & mask_;
}

/// A counting sort of the bodies by buckets of cells; they ascend within each.
void Nearby::FillCells() {
  const size_t n = boxes_.size();
  size_t buckets = 16;
  while (buckets < 2 * n) buckets *= 2;
  mask_ = buckets - 1;
  starts_.assign(buckets + 1, 0);
  large_.clear();
  const auto for_each_cell = [this](const CellRange& range, auto f) {
    for (int32_t y = range.y0; y <= range.y1; y++)
      for (int32_t x = range.x0; x <= range.x1; x++) f(x, y);
  };
  for (size_t i = 0; i < n; i++) {
    const CellRange range = CellsOf(boxes_[i]);
    if (range.count() > kMostCells)
      large_.push_back(static_cast<uint32_t>(i));
    else
      for_each_cell(range, [this](int32_t x, int32_t y) { starts_[BucketOf(x, y)]++; });
  }
  uint32_t sum = 0;
  for (uint32_t& start : starts_) start = sum += start;
  entries_.resize(sum);
  for (size_t i = n; i-- > 0;) {
    const CellRange range = CellsOf(boxes_[i]);
    if (range.count() > kMostCells) continue;
    for_each_cell(range, [this, i](int32_t x, int32_t y) {
      entries_[--starts_[BucketOf(x, y)]] = {x, y, static_cast<uint32_t>(i)};
    });
  }
}

void Nearby::TryPair(uint32_t a, uint32_t b, const Columns& columns) {
  if (reach[a] == 0.0 && reach[b] == 0.0) return;
  if (columns.group[a] == columns.group[b] && columns.group[a] != kNoGroup) return;
  const double dx = columns.x[a] - columns.x[b], dy = columns.y[a] - columns.y[b];
  const double far = bound_[a] + bound_[b] + reach[a] + reach[b] + kTouch;
  if (dx * dx + dy * dy < far * far) found_.push_back(a < b ? NearPair{a, b} : NearPair{b, a});
}

void Nearby::FindPairsInBucket(size_t bucket, const Columns& columns) {
  for (uint32_t k = starts_[bucket]; k < starts_[bucket + 1]; k++)
    for (uint32_t m = k + 1; m < starts_[bucket + 1]; m++) {
      const Entry &first = entries_[k], &second = entries_[m];
      if (first.x != second.x || first.y != second.y) continue;
      const Box &a = boxes_[first.body], &b = boxes_[second.body];
      if (!Overlap(a, b)) continue;
      // Found in the first cell that both cover, so that it is found once.
      const double x = Most(a.x0, b.x0), y = Most(a.y0, b.y0);
      const CellRange cell = CellsOf({x, y, x, y});
      if (cell.x0 == first.x && cell.y0 == first.y) TryPair(first.body, second.body, columns);
    }
}

void Nearby::FindPairs(const Columns& columns) {
  found_.clear();
  for (size_t bucket = 0; bucket <= mask_; bucket++)
    if (starts_[bucket + 1] > starts_[bucket] + 1) FindPairsInBucket(bucket, columns);
  for (const uint32_t a : large_)
    for (uint32_t b = 0; b < boxes_.size(); b++) {
      const bool both_large = b < a && std::binary_search(large_.begin(), large_.end(), b);
      if (b != a && !both_large && Overlap(boxes_[a], boxes_[b])) TryPair(a, b, columns);
    }
}

/// Pairs of a body whose reach has grown: a search with its new box. The others are in the cells of
/// their boxes when the cells were filled, so those that have grown as well are searched besides.
void Nearby::FindPairsOf(uint32_t body, const Columns& columns) {
  const Box& box = boxes_[body];
  const CellRange range = CellsOf(box);
  const auto try_other = [&](uint32_t other) {
    if (other != body && Overlap(box, boxes_[other])) TryPair(body, other, columns);
  };
  if (range.count() > 4 * kMostCells) {
    for (uint32_t other = 0; other < boxes_.size(); other++) try_other(other);
    return;
  }
  for (int32_t y = range.y0; y <= range.y1; y++)
    for (int32_t x = range.x0; x <= range.x1; x++) {
      const size_t bucket = BucketOf(x, y);
      for (uint32_t k = starts_[bucket]; k < starts_[bucket + 1]; k++)
        if (entries_[k].x == x && entries_[k].y == y) try_other(entries_[k].body);
    }
  for (const uint32_t other : large_) try_other(other);
  for (const uint32_t other : queue_) try_other(other);
}

/// Gives pushable bodies the reach of what may push them, until nothing changes. The result is the
/// largest reach that comes to a body along pairs, whatever the order.
void Nearby::SpreadReaches(const Columns& columns) {
  queue_.clear();
  const auto spread = [&](uint32_t to, uint32_t from) {
    if (!columns.pushable[to] || push_[from] <= push_[to]) return;
    reach[to] = push_[to] = push_[from];
    SetBox(to, columns);
    queue_.push_back(to);
  };
  const auto spread_pairs = [&](size_t first) {
    for (size_t k = first; k < found_.size(); k++) {
      const NearPair pair = found_[k];
      spread(pair.a, pair.b);
      spread(pair.b, pair.a);
    }
  };
  spread_pairs(0);
  for (size_t next = 0; next < queue_.size(); next++) {
    // Found again: pairs that were known, which must carry the new reach too.
    const size_t first = found_.size();
    FindPairsOf(queue_[next], columns);
    spread_pairs(first);
  }
}

void Nearby::FindWalls(const Walls& edges, const Columns& columns) {
  walls.clear();
  for (uint32_t i = 0; i < boxes_.size(); i++) {
    if (reach[i] == 0.0) continue;
    const size_t first = walls.size();
    const double far = bound_[i] + reach[i] + kTouch;
    edges.ForEachNear(boxes_[i], [&](uint32_t k) {
      const WallEdge& edge = edges.edges()[k];
      if (edge.group == columns.group[i] && edge.group != kNoGroup) return;
      if (SquaredDistance({columns.x[i], columns.y[i]}, edge) < far * far) walls.push_back({i, k});
    });
    std::sort(walls.begin() + static_cast<std::ptrdiff_t>(first), walls.end(),
              [](const NearPair& a, const NearPair& b) { return a.b < b.b; });
  }
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

void Nearby::Find(const Shapes& shapes, const Walls& edges, const Columns& columns,
                  double least_reach) {
  FindReaches(shapes, columns, least_reach);
  FillCells();
  FindPairs(columns);
  SpreadReaches(columns);
  FindWalls(edges, columns);
  pairs.swap(found_);
  const auto order = [](const NearPair& a, const NearPair& b) {
    return a.a != b.a ? a.a < b.a : a.b < b.b;
  };
  std::sort(pairs.begin(), pairs.end(), order);
  pairs.erase(
      std::unique(pairs.begin(), pairs.end(),
                  [](const NearPair& a, const NearPair& b) { return a.a == b.a && a.b == b.b; }),
      pairs.end());
  FormIslands(columns);
  SortByIsland(&pairs, &Island::first_pair, &Island::last_pair);
  SortByIsland(&walls, &Island::first_wall, &Island::last_wall);
}

}  // namespace Stg::motion
