// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays of readings that nobody sees are not cast, and nothing else changes.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "rows/row_bridge.hh"
#include "stage.hh"
#include "support/closed_world.hh"
#include "support/model_testing.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"

namespace {

using Stg::test::ClosedWorldKind;
using Stg::test::RandomSource;

std::unique_ptr<Stg::World> Load(const std::string& text, uint64_t idle, uint64_t seed) {
  Stg::RunOptions options;
  options.seed = seed;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  Stg::test::SubscribeToMost(world.get(), idle);
  return world;
}

/// Numbers of rays, by what became of the readings of a call of Step().
struct Happened {
  size_t cast = 0, left_out = 0, needed = 0;
};

/// A world, and a row of which several steps are made at once.
class Twins {
 public:
  Twins(const std::string& text, uint64_t idle, uint64_t seed)
      : world_(Load(text, idle, seed)), written_(Load(text, idle, 5)) {
    std::string reason;
    scene_ = Stg::RowBridge::MakeScene(Load(text, idle, 77), &reason);
    EXPECT_TRUE(scene_) << reason;
    if (!scene_) return;
    row_ = std::make_unique<Stg::rows::Rows>(scene_, std::vector<uint64_t>{seed});
    scratch_ = row_->MakeScratch();
  }

  bool ready() const { return row_ != nullptr; }

  void Command(RandomSource* random) {
    for (size_t i = 0; i < scene_->movers.size(); i++) {
      const Stg::rows::Mover& mover = scene_->movers[i];
      if (!mover.robot || !mover.runs || random->OneIn(2)) continue;
      const double x = random->Real(-1, 1), y = random->Real(-1, 1), a = random->Real(-2, 2);
      static_cast<Stg::ModelPosition*>(world_->FindModel(mover.model->GetId()))->SetSpeed(x, y, a);
      row_->columns.mode[i] = Stg::DriveInput::kVelocity;
      row_->columns.command[i] = {x, y, a};
    }
  }

  /// `unseen`: steps after these before anybody looks at readings.
  void Step(uint64_t steps, uint64_t unseen, Happened* happened) {
    // Controllers read ranges, but not what was hit.
    std::vector<uint8_t>& brightness = row_->columns.brightness;
    const std::vector<uint8_t> before = brightness;
    constexpr uint8_t kMark = 255;
    std::ranges::fill(brightness, kMark);
    const std::vector<Stg::usec_t> last_update = row_->columns.last_update;
    row_->Step(0, steps, scratch_.get(), unseen);
    for (uint64_t i = 0; i < steps; i++) world_->Update();
    for (const Stg::rows::Sensor& sensor : scene_->sensors) {
      const bool updated = row_->LastUpdate(0, sensor.rate) != last_update[sensor.rate];
      for (size_t ray = sensor.first_ray; ray < sensor.first_ray + sensor.rays; ray++) {
        const bool cast = brightness[ray] != kMark;
        if (!cast) brightness[ray] = before[ray];
        EXPECT_EQ(cast, updated && (sensor.needed || !IsUpdatedWithin(unseen, sensor.rate)));
        if (updated)
          (sensor.needed ? happened->needed : cast ? happened->cast : happened->left_out)++;
      }
    }
  }

  /// Compares the states, for `lean` without readings that the next step replaces.
  bool AreEqual(bool lean) {
    const auto keep = lean ? Stg::Snapshot::kLean : Stg::Snapshot::kFull;
    Stg::Snapshot of_world, of_row;
    return Stg::RowBridge::Write(*row_, 0, written_.get()) && world_->Take(&of_world, keep) &&
           written_->Take(&of_row, keep) && of_world.hash() == of_row.hash();
  }

 private:
  bool IsUpdatedWithin(uint64_t steps, uint32_t rate) const {
    const Stg::rows::Columns& c = row_->columns;
    return c.next_update[rate] <= c.time[0] + steps * scene_->step;
  }

  std::unique_ptr<Stg::World> world_, written_;
  std::shared_ptr<const Stg::rows::Scene> scene_;
  std::unique_ptr<Stg::rows::Rows> row_;
  std::shared_ptr<Stg::rows::Rows::Scratch> scratch_;
};

/// Number of random worlds; more for a long search.
uint64_t Worlds() {
  const char* const wanted = std::getenv("STAGE_RANDOM_WORLDS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : kSanitized ? 10 : 80;
}

/// The text with another step, so that updates are in each step or in some, at even or odd
/// distances.
std::string WithAnyStep(const std::string& text, RandomSource* random) {
  return "interval_sim " + std::to_string(random->Pick<int>({10, 30, 50, 100, 100, 250})) +
         text.substr(text.find('\n'));
}

TEST(UnseenReadings, ChangeNothingElse) {
  Stg::InitLibrary();
  Happened happened;
  for (uint64_t seed = 1; seed <= Worlds(); seed++) {
    RandomSource random(seed);
    const ClosedWorldKind kind{random.OneIn(2), random.OneIn(2), random.Int(1, 5), 3,
                               random.OneIn(3), random.OneIn(3)};
    const std::string text = WithAnyStep(ClosedWorld(kind, &random), &random);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + text);
    Twins twins(text, random.OneIn(2) ? 0 : random.Next() & random.Next(), random.Next());
    if (!twins.ready()) continue;
    for (int round = 0; round < 20; round++) {
      twins.Command(&random);
      const bool lean = random.OneIn(2);
      twins.Step(static_cast<uint64_t>(random.Int(1, 20)), lean, &happened);
      ASSERT_TRUE(twins.AreEqual(lean)) << "round " << round;
    }
  }
  const size_t scale = kSanitized ? 10 : 1;
  EXPECT_GT(happened.cast, 10000u / scale);
  EXPECT_GT(happened.left_out, 10000u / scale);
  EXPECT_GT(happened.needed, 10000u / scale);
}

}  // namespace
