// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/body_index.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "support/motion_world.hh"

namespace {

using Stg::motion::BodyIndex;
using Stg::motion::Box;
using Stg::motion::Overlap;
using test::Numbers;

using Pairs = std::vector<std::pair<uint32_t, uint32_t>>;

Box BoxAt(double x, double y, double half) { return {x - half, y - half, x + half, y + half}; }

/// Boxes whose widths differ by factors of up to 10^orders, around a place.
std::vector<Box> RandomBoxes(size_t count, double orders, double place, Numbers* random) {
  std::vector<Box> boxes;
  for (size_t i = 0; i < count; i++) {
    const double half = 0.1 * std::pow(10.0, random->Between(0.0, orders));
    const double side = 0.4 * std::sqrt(static_cast<double>(count));
    boxes.push_back(
        BoxAt(place + random->Between(0.0, side), random->Between(-side, side) - place, half));
  }
  return boxes;
}

Pairs OverlappingPairs(const std::vector<Box>& boxes) {
  Pairs pairs;
  for (uint32_t a = 0; a < boxes.size(); a++)
    for (uint32_t b = a + 1; b < boxes.size(); b++)
      if (Overlap(boxes[a], boxes[b])) pairs.emplace_back(a, b);
  return pairs;
}

Pairs FoundPairs(const std::vector<Box>& boxes) {
  BodyIndex index;
  index.Fill(boxes);
  Pairs pairs;
  for (uint32_t a = 0; a < boxes.size(); a++)
    index.ForEachPartner(a, boxes[a], [&](uint32_t b) {
      if (Overlap(boxes[a], boxes[b])) pairs.emplace_back(std::min(a, b), std::max(a, b));
    });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

TEST(BodyIndex, FindsEachOverlappingPairOnceWhateverTheSizesAndPlace) {
  Numbers random(1);
  size_t pairs = 0;
  for (const size_t count : {0u, 1u, 2u, 7u, 40u, 300u, 1000u})
    for (const double orders : {0.0, 0.3, 1.0, 3.0})
      for (const double place : {0.0, -37.0, 1e6, 1e11}) {
        const std::vector<Box> boxes = RandomBoxes(count, orders, place, &random);
        const Pairs expected = OverlappingPairs(boxes);
        ASSERT_EQ(FoundPairs(boxes), expected) << count << " " << orders << " " << place;
        pairs += expected.size();
      }
  EXPECT_GT(pairs, 10000u);
}

TEST(BodyIndex, ASearchFindsWhatABoxOverlapsOnce) {
  Numbers random(2);
  for (const double half : {1e-3, 0.3, 20.0, 1e9}) {
    const std::vector<Box> boxes = RandomBoxes(500, 2.0, 5.0, &random);
    BodyIndex index;
    index.Fill(boxes);
    for (int i = 0; i < 50; i++) {
      const Box box = BoxAt(random.Between(0.0, 15.0), random.Between(-10.0, 10.0), half);
      std::vector<uint32_t> found, expected;
      index.ForEachNear(box, [&](uint32_t body) {
        if (Overlap(box, boxes[body])) found.push_back(body);
      });
      for (uint32_t body = 0; body < boxes.size(); body++)
        if (Overlap(box, boxes[body])) expected.push_back(body);
      std::sort(found.begin(), found.end());
      ASSERT_EQ(found, expected) << half;
    }
  }
}

TEST(BodyIndex, BoxesWithoutEndOverlapAllOthers) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<Box> boxes{BoxAt(0, 0, 1), BoxAt(100, 3, 1), BoxAt(5, 5, kInfinite),
                         BoxAt(-1e300, 0, 1e290)};
  EXPECT_EQ(FoundPairs(boxes), OverlappingPairs(boxes));
}

}  // namespace
