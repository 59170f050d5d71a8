// SPDX-License-Identifier: GPL-2.0-or-later
//
// The source of the kernels is compiled as C++, so that sanitizers can check it. Its hits must
// equal those of the host's walk and of a walk from cell to cell.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <utility>
#include <vector>

#include "support/ray_scene.hh"

// ---- OpenCL C as C++ ----------------------------------------------------------------------------

#undef STAGE_KERNELS_RAY_WALK_H
#undef STAGE_KERNELS_RECORDS_H
#undef RAY_ALIGNED
#undef RAY_GLOBAL
#undef RAY_FUNCTION
#undef RAY_LARGE_FUNCTION

namespace opencl_c {

using uint = std::uint32_t;
using ulong = std::uint64_t;
struct int4 {
  int x, y, z, w;
};

thread_local std::size_t global_id = 0;
std::size_t get_global_id(unsigned) { return global_id; }

/// Replaces float in the kernels. Its value has an error of up to 3, which must not matter. It
/// cannot be compared, so that code in which a float decides anything does not compile.
class Guess {
 public:
  Guess() = default;
  Guess(double value) : value_(value) {}
  friend Guess operator*(Guess a, Guess b) { return a.value_ * b.value_; }
  friend Guess operator/(Guess a, Guess b) { return a.value_ / b.value_; }
  explicit operator int() const {
    static thread_local unsigned count = 0;
    return static_cast<int>(value_) + static_cast<int>(count++ % 7 * 65536) - 3 * 65536;
  }

 private:
  double value_;
};

#ifdef __clang__
#pragma clang diagnostic ignored "-Wkeyword-macro"
#endif
// NOLINTBEGIN(bugprone-reserved-identifier,clang-diagnostic-keyword-macro)
#define __OPENCL_VERSION__ 110
#define __kernel
#define __global
#define long std::int64_t
#define float Guess
// NOLINTEND(bugprone-reserved-identifier,clang-diagnostic-keyword-macro)
#include "kernels/ray_walk.h"
// The order matters: each file uses declarations of the previous ones.
#include "kernels/records.h"
// This file must come last.
#include "kernels/prefilter.cl"
#undef float
#undef long
#undef __global
#undef __kernel
#undef __OPENCL_VERSION__

}  // namespace opencl_c

namespace {

using ray_scene::RayScene;
namespace sensing = Stg::internal::sensing;

constexpr std::size_t kWorkGroup = 64;

template <typename Kernel>
void Launch(std::size_t items, Kernel kernel) {
  // Run whole work-groups, as on a device; the last items have nothing to do.
  const std::size_t rounded = (items + kWorkGroup - 1) / kWorkGroup * kWorkGroup;
  for (opencl_c::global_id = 0; opencl_c::global_id < rounded; opencl_c::global_id++) kernel();
}

/// The words of HitLists, computed by the kernel.
std::vector<uint32_t> ListsByKernel(const RayScene& scene, uint32_t per_ray) {
  const sensing::RayBatch& batch = scene.batch();
  std::map<std::pair<uint32_t, uint32_t>, std::vector<sensing::FanRecord>> launches;
  for (const sensing::Fan& fan : batch.fans())
    if (fan.single_leg() && fan.record.samples > 0)
      launches[{fan.layer, fan.record.samples}].push_back(fan.record);

  std::vector<opencl_c::ray_direction_t> directions;
  for (const std::vector<sensing::Direction>* part :
       {&scene.tables().all(), &batch.own_directions()})
    for (const sensing::Direction& d : *part) directions.push_back({d.cosine, d.sine});
  std::vector<uint32_t> hits(static_cast<std::size_t>(batch.ray_count()) * (1 + per_ray), 0);

  // Put all groups into one launch, with empty groups between them and in front, because a launch
  // need not begin at the first group.
  const std::size_t groups = 2 * launches.size() + 1;
  std::vector<opencl_c::ray_group_record_t> records(groups);
  std::vector<opencl_c::ray_fan_record_t> fan_records(5);  // fans need not begin at 0, either
  std::vector<uint64_t> words;                             // bodies come first
  for (uint32_t slot = 0; slot < 64 * scene.grid().region_count(); slot += 2)
    words.push_back(scene.grid().OnlyBody(slot) | uint64_t{scene.grid().OnlyBody(slot + 1)} << 32);
  const auto region_maps = static_cast<uint32_t>(words.size());
  words.insert(words.end(), scene.grid().region_maps().begin(), scene.grid().region_maps().end());
  std::size_t items = 0, group = 1;
  const auto number = [](std::size_t n) { return static_cast<uint32_t>(n); };
  for (const auto& [launch, fans] : launches) {
    const auto& [layer, samples] = launch;
    const Stg::internal::grid::Occupancy& cells = scene.grid().occupancy(layer);
    records[group] = {.first_item = number(items),
                      .fans = number(fans.size()),
                      .samples = samples,
                      .first_fan = number(fan_records.size()),
                      .region_maps = region_maps,
                      .tile_maps = number(words.size()),
                      .tiles = number(words.size() + cells.tile_maps().size()),
                      .layer = layer};
    words.insert(words.end(), cells.tile_maps().begin(), cells.tile_maps().end());
    words.insert(words.end(), cells.tiles().begin(), cells.tiles().end());
    for (const sensing::FanRecord& fan : fans) {
      static_assert(sizeof(fan) == sizeof(fan_records[0]));
      std::memcpy(&fan_records.emplace_back(), &fan, sizeof fan);
    }
    items += (fans.size() * samples + kWorkGroup - 1) / kWorkGroup * kWorkGroup;
    records[group + 1] = {};
    records[group + 1].first_item = number(items);
    records[group + 1].samples = 1;
    group += 2;
  }
  std::vector<uint64_t> masks(3);  // masks need not begin at 0, either
  masks.insert(masks.end(), batch.mask_words().begin(), batch.mask_words().end());
  const Stg::ray_grid_t view = scene.grid().View(Stg::internal::grid::kEverything);
  const opencl_c::int4 box{view.min_x, view.min_y, view.max_x, view.max_y};
  Launch(items, [&] {
    opencl_c::walk_fans(reinterpret_cast<const opencl_c::ray_super_t*>(view.directory),
                        view.directory_mask, view.regions, words.data(), box, records.data(), 1,
                        static_cast<uint32_t>(groups), fan_records.data(), directions.data(),
                        masks.data(), 3, per_ray, hits.data());
  });
  return hits;
}

constexpr uint64_t kScenes = 120;
constexpr int kRounds = 4;

TEST(KernelCxxTest, FindsWhatTheHostFinds) {
  uint64_t listed = 0;
  for (uint64_t seed = 1; seed <= kScenes; seed++) {
    RayScene scene(seed);
    const uint32_t per_ray = 1 + seed % 4;
    for (int round = 0; round < kRounds; round++) {
      const std::vector<uint32_t> expected = ListsByWalk(scene, per_ray);
      const std::vector<uint32_t> words = ListsByKernel(scene, per_ray);
      const sensing::HitLists found{words.data(), per_ray};
      ASSERT_EQ(FirstDifference(scene, expected, found), "") << seed << ", round " << round;
      ASSERT_EQ(FirstWrongBody(scene, found), "") << seed << ", round " << round;
      for (const uint32_t hit : expected) listed += hit != 0 && hit != RAY_NO_HIT;
      scene.Change();
      scene.MakeBatch();
    }
  }
  EXPECT_GT(listed, 10000u);
}

TEST(KernelCxxTest, FindsWhatAPlainWalkFinds) {
  for (uint64_t seed = 1001; seed <= 1000 + kScenes; seed++) {
    RayScene scene(seed);
    const uint32_t per_ray = 1 + seed % 4;
    for (int round = 0; round < kRounds; round++) {
      const std::vector<uint32_t> expected = ListsCellByCell(scene, per_ray);
      const std::vector<uint32_t> words = ListsByKernel(scene, per_ray);
      const sensing::HitLists found{words.data(), per_ray};
      ASSERT_EQ(FirstDifference(scene, expected, found), "") << seed << ", round " << round;
      ASSERT_EQ(FirstWrongBody(scene, found), "") << seed << ", round " << round;
      scene.Change();
      scene.MakeBatch();
    }
  }
}

TEST(KernelCxxTest, UpdatesTheWordsThatItIsGiven) {
  std::vector<uint64_t> words(200, 7);
  const std::vector<uint64_t> values{~uint64_t{0}, 1, uint64_t{1} << 63};
  std::vector<uint32_t> changes(6);  // values, then their places
  std::memcpy(changes.data(), values.data(), 6 * sizeof(uint32_t));
  changes.insert(changes.end(), {199, 0, 66});
  Launch(values.size(), [&] {
    opencl_c::update_words(words.data(), values.data(), changes.data(),
                           static_cast<uint32_t>(values.size()));
  });
  for (std::size_t i = 0; i < words.size(); i++)
    EXPECT_EQ(words[i], i == 199 ? values[0] : i == 0 ? values[1] : i == 66 ? values[2] : 7u) << i;
}

}  // namespace
