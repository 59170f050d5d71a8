// SPDX-License-Identifier: GPL-2.0-or-later

#include "benchmarks/truth/box_tree.hh"

#include <numeric>

namespace truth {

namespace {

constexpr uint32_t kItemsOfLeaf = 4;
/// Metres. Far greater than any rounding error, but small enough to cost no time.
constexpr Real kSlack = 1e-9L;

Point CentreOf(const Box& box) {
  return {(box.low.x + box.high.x) / 2, (box.low.y + box.high.y) / 2};
}

}  // namespace

void BoxTree::Build(const std::vector<Box>& boxes) {
  nodes_.clear();
  items_.resize(boxes.size());
  std::iota(items_.begin(), items_.end(), 0u);
  if (boxes.empty()) return;
  nodes_.emplace_back();
  Split(0, 0, static_cast<uint32_t>(boxes.size()), boxes);
}

void BoxTree::Split(uint32_t node, uint32_t begin, uint32_t end, const std::vector<Box>& boxes) {
  Box all = boxes[items_[begin]];
  for (uint32_t i = begin; i < end; i++) all = Joined(all, boxes[items_[i]]);
  nodes_[node].centre = CentreOf(all);
  nodes_[node].half = {(all.high.x - all.low.x) / 2 + kSlack,
                       (all.high.y - all.low.y) / 2 + kSlack};
  if (end - begin <= kItemsOfLeaf) {
    nodes_[node].first = begin;
    nodes_[node].items = end - begin;
    return;
  }
  const bool wide = all.high.x - all.low.x > all.high.y - all.low.y;
  const uint32_t middle = begin + (end - begin) / 2;
  const auto item = [this](uint32_t i) { return items_.begin() + static_cast<long>(i); };
  std::nth_element(item(begin), item(middle), item(end), [&](uint32_t a, uint32_t b) {
    const Point p = CentreOf(boxes[a]), q = CentreOf(boxes[b]);
    return wide ? p.x < q.x : p.y < q.y;
  });
  const uint32_t children = static_cast<uint32_t>(nodes_.size());
  nodes_[node].first = children;
  nodes_.resize(nodes_.size() + 2);
  Split(children, begin, middle, boxes);
  Split(children + 1, middle, end, boxes);
}

}  // namespace truth
