// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random heaps with contacts of outlines. In all of them: nothing overlaps that did not before,
// nothing passes a wall, the world stays valid, and results are equal with any number of threads,
// after snapshots, in branches and in copies.
//
// STAGE_HEAPS=N tests N worlds instead of a few, from number STAGE_FIRST_HEAP on, and prints what
// was done.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/heap_driver.hh"
#include "support/heap_text.hh"
#include "support/model_testing.hh"
#include "support/overlaps.hh"
#include "support/own_worlds.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

using test::HeapDriver;
using test::HeapText;
using test::PlacedOutlines;

constexpr uint64_t kSteps = 24, kSnapshotAt = 13;

RunOptions OptionsFor(int threads) {
  RunOptions options = OptionsOf(3);
  options.threads = threads;
  options.share_from = 1;
  return options;
}

std::unique_ptr<World> Load(const HeapText& heap, int threads) {
  auto world = std::make_unique<World>(OptionsFor(threads));
  std::istringstream text(heap.text());
  EXPECT_TRUE(world->Load(text, "heap.world")) << heap.text();
  return world;
}

/// Steps a world until it has made `steps` steps. Returns the state hash after each.
std::vector<uint64_t> Run(const HeapText& heap, uint64_t seed, World* world, uint64_t steps) {
  std::vector<uint64_t> hashes;
  while (world->GetUpdateCount() < steps) {
    HeapDriver(heap, seed, world).Drive();
    world->Update();
    hashes.push_back(world->StateHash());
  }
  return hashes;
}

class DrivenBranches : public Scenario {
 public:
  DrivenBranches(const HeapText& heap, uint64_t seed) : heap_(heap), seed_(seed) {}
  void BeforeStep(World& world, uint32_t branch) override {
    HeapDriver(heap_, branch == 0 ? seed_ : seed_ + 77, &world).Drive();
  }

 private:
  const HeapText& heap_;
  const uint64_t seed_;
};

// ---- one heap -----------------------------------------------------------------------------------

struct Totals {
  size_t worlds = 0, worlds_in_contact = 0, mover_steps = 0, contacts = 0, overlaps = 0, pushed = 0,
         stalled = 0;
};

size_t CountContacts(const World& world) {
  size_t count = 0;
  world.ForEachContact([&](const ContactPoint&) { count++; });
  return count;
}

/// Adds to the totals what the step has done.
void Count(World& world, const std::vector<std::pair<const Model*, Pose>>& things, Totals* totals) {
  for (const auto& [thing, before] : things) totals->pushed += !(thing->GetPose() == before);
  for (Model* model : world.host().models) totals->stalled += model->Stalled();
}

std::vector<std::pair<const Model*, Pose>> ThingsOf(World& world) {
  std::vector<std::pair<const Model*, Pose>> things;
  for (const Model* model : world.host().models)
    if (!model->Parent() && model->IsPushable() && !dynamic_cast<const ModelPosition*>(model))
      things.emplace_back(model, model->GetPose());
  return things;
}

/// Runs a heap with one thread while it is checked. Takes a snapshot in the middle.
std::vector<uint64_t> RunChecked(const HeapText& heap, uint64_t seed, World* world,
                                 Snapshot* snapshot, Totals* totals) {
  std::vector<uint64_t> hashes;
  PlacedOutlines before(*world, heap.room());
  totals->overlaps += before.overlaps();
  while (world->GetUpdateCount() < kSteps) {
    if (HeapDriver(heap, seed, world).Drive()) before = PlacedOutlines(*world, heap.room());
    const auto things = ThingsOf(*world);
    world->Update();
    hashes.push_back(world->StateHash());
    PlacedOutlines after(*world, heap.room());
    EXPECT_EQ(after.FaultsSince(before), "") << "step " << world->GetUpdateCount();
    EXPECT_EQ(world->Validate(), "") << "step " << world->GetUpdateCount();
    if (testing::Test::HasFailure()) return hashes;
    totals->mover_steps += after.movers();
    Count(*world, things, totals);
    before = std::move(after);
    if (world->GetUpdateCount() != kSnapshotAt) continue;
    EXPECT_TRUE(world->Take(snapshot));
    const size_t contacts = CountContacts(*world);  // must not change the world
    totals->contacts += contacts;
    totals->worlds_in_contact += contacts > 0;
  }
  return hashes;
}

uint64_t HashOfBranch(const HeapText& heap, uint64_t seed, const World& world,
                      const Snapshot& snapshot) {
  BranchOptions options;
  options.threads = 2;
  Branches branches(world, 2, options);
  for (uint32_t i = 0; i < 2; i++) branches.Restore(i, snapshot);
  DrivenBranches scenario(heap, seed);
  branches.Step(3, &scenario);
  branches.Step(kSteps - kSnapshotAt - 3, &scenario);
  uint64_t hash = 0;
  EXPECT_TRUE(branches.Visit(0, [&](World& branch) { hash = branch.StateHash(); }));
  return hash;
}

/// Runs the heap with this number in all ways.
void TestHeap(uint64_t seed, Totals* totals) {
  const HeapText heap(seed);
  const auto world = Load(heap, 1);
  Snapshot snapshot;
  const std::vector<uint64_t> hashes = RunChecked(heap, seed, world.get(), &snapshot, totals);
  totals->worlds++;
  if (testing::Test::HasFailure()) return;
  for (const int threads : {2, 5})
    EXPECT_EQ(Run(heap, seed, Load(heap, threads).get(), kSteps), hashes) << threads << " threads";
  const std::vector<uint64_t> later(hashes.begin() + kSnapshotAt, hashes.end());
  ASSERT_TRUE(world->Restore(snapshot));
  EXPECT_EQ(world->Validate(), "") << "restored";
  EXPECT_EQ(Run(heap, seed, world.get(), kSteps), later) << "restored in the world";
  const auto fresh = Load(heap, 2);
  ASSERT_TRUE(fresh->Restore(snapshot));
  EXPECT_EQ(Run(heap, seed, fresh.get(), kSteps), later) << "restored in a fresh world";
  EXPECT_EQ(HashOfBranch(heap, seed, *world, snapshot), hashes.back()) << "branch";
  World copy(OptionsFor(1));
  ASSERT_TRUE(copy.LoadCopy(*world));
  EXPECT_EQ(Run(heap, seed, &copy, kSteps), hashes) << "copy";
}

uint64_t Number(const char* name, uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

class OutlinesProduct : public testing::Test {
 protected:
  void SetUp() override {
    InitLibrary();
    SetLogSink([](LogLevel, const std::string&) {});  // warnings of robots inside of other bodies
  }
  void TearDown() override { SetLogSink(nullptr); }
};

TEST_F(OutlinesProduct, RandomHeapsNeverOverlapAndGiveEqualResultsInAllWays) {
  const uint64_t count = Number("STAGE_HEAPS", kSanitized ? 6 : 24);
  const uint64_t first = Number("STAGE_FIRST_HEAP", 1);
  Totals totals;
  for (uint64_t seed = first; seed < first + count; seed++) {
    SCOPED_TRACE("STAGE_HEAPS=1 STAGE_FIRST_HEAP=" + std::to_string(seed));
    TestHeap(seed, &totals);
  }
  if (std::getenv("STAGE_HEAPS") != nullptr) {
    std::printf(
        "%zu worlds, %zu in contact at the snapshot with %zu contacts, %zu overlaps at the start, "
        "%zu steps of movers, %zu moves of things, %zu stalls\n",
        totals.worlds, totals.worlds_in_contact, totals.contacts, totals.overlaps,
        totals.mover_steps, totals.pushed, totals.stalled);
    return;
  }
  // The heaps are such that there is something to find.
  EXPECT_GT(totals.worlds_in_contact, count / 3);
  EXPECT_GT(totals.contacts, 5 * count);
  EXPECT_GT(totals.overlaps, count);
  EXPECT_GT(totals.pushed, 5 * count);
  EXPECT_GT(totals.stalled, 30 * count);
}

TEST_F(OutlinesProduct, HeapsThatHadAnErrorOnceHaveNone) {
  Totals totals;
  for (const uint64_t seed : {5191}) {  // pushed by more than a turn
    SCOPED_TRACE("STAGE_HEAPS=1 STAGE_FIRST_HEAP=" + std::to_string(seed));
    TestHeap(seed, &totals);
  }
}

TEST_F(OutlinesProduct, TheCheckFindsOverlapsAndPassedWalls) {
  const auto world = LoadText(
      "contacts \"outlines\"\n"
      "model( name \"frame\" size [6 6 1] )\n"
      "model( name \"box\" pose [2 0 0 0] size [1 1 1] )\n"
      "position( name \"disc_round\" round 1 size [0.4 0.4 0.4] )\n"
      "position( name \"star\" pose [0 1 0 0] size [1 1 0.4] block( points 4 point[0] [0 0]\n"
      "  point[1] [3 1] point[2] [0 2] point[3] [1 1] z [0 1] ) )\n"
      "position( name \"above\" pose [0 -1 0.5 0] size [0.4 0.4 0.4] )\n");
  const PlacedOutlines before(*world);
  EXPECT_EQ(before.movers(), 3u);
  EXPECT_EQ(before.overlaps(), 0u);
  EXPECT_EQ(before.FaultsSince(before), "");
  const auto faults = [&](const std::string& name, double x, double y) {
    Model* model = Find<>(*world, name);
    const Pose home = model->GetPose();
    model->SetPose(Pose(x, y, home.z, home.a));
    const std::string found = PlacedOutlines(*world).FaultsSince(before);
    model->SetPose(home);
    return !found.empty();
  };
  EXPECT_FALSE(faults("disc_round", 1.2, 0));
  EXPECT_TRUE(faults("disc_round", 1.4, 0));     // crosses the box
  EXPECT_TRUE(faults("disc_round", 2, 0));       // inside of the box
  EXPECT_TRUE(faults("disc_round", 2.9, 0));     // crosses the frame
  EXPECT_TRUE(faults("disc_round", 30, 0));      // outside of the frame
  EXPECT_TRUE(faults("disc_round", 0.2, 1));     // inside of the star
  EXPECT_FALSE(faults("disc_round", -0.42, 1));  // in its notch
  EXPECT_TRUE(faults("disc_round", 0.5, 1));
  EXPECT_FALSE(faults("above", 0, 1));
  EXPECT_TRUE(faults("above", 2.4, 0));
}

}  // namespace
}  // namespace Stg
