// SPDX-License-Identifier: GPL-2.0-or-later
//
// A restored world continues as if nothing had happened since the snapshot: it has the same state
// hashes after further steps, in place and in another world of the same file.

#include "world/snapshot.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/all_models.hh"
#include "support/meddler.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"
#include "support/snapshot_files.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

constexpr int kSteps = kSanitized ? 10 : 30, kFewSteps = kSanitized ? 5 : 10;

uint64_t HashAfter(World* world, int steps) {
  for (int i = 0; i < steps; i++) world->Update();
  return world->StateHash();
}

/// The bodies and cells of a model in the grid, without the order of bodies in cells.
std::vector<double> DrawingOf(World* world, const Model& model) {
  std::vector<double> all;
  const internal::grid::Grid& grid = world->engine().scene.grid;
  model.body().ForEachBody([&](uint32_t id, const std::vector<internal::grid::CellSet>& sets) {
    const internal::grid::Body& body = grid.body(id);
    all.insert(all.end(), {body.z_min, body.z_max});
    // The flag of visibility does not matter for transparent models, and for those that become
    // visible again before rays are traced.
    all.push_back(body.ranger_visible || model.vis.ranger_return < 0 ||
                  model.is_hidden_from_rangers());
    all.push_back(static_cast<const Model*>(body.tree)->GetId());
    for (const internal::grid::CellSet& set : sets)
      all.insert(all.end(), {double(set.x), double(set.y), static_cast<double>(set.cells)});
  });
  return all;
}

/// Describes the first difference between two worlds; empty if they are in the same state.
std::string Difference(World* a, World* b) {
  const std::vector<Model*> of_a = all_models::ByNumber(a), of_b = all_models::ByNumber(b);
  if (of_a.size() != of_b.size()) return "the number of models";
  for (size_t i = 0; i < of_a.size(); i++) {
    StateExchange::Bytes bytes_a, bytes_b;
    StateExchange save_a(of_a, &bytes_a), save_b(of_b, &bytes_b);
    of_a[i]->ExchangeState(save_a);
    of_b[i]->ExchangeState(save_b);
    if (DrawingOf(a, *of_a[i]) != DrawingOf(b, *of_b[i]))
      return of_a[i]->TokenStr() + " is drawn in another way";
    if (bytes_a == bytes_b) continue;
    const auto place = std::ranges::mismatch(bytes_a, bytes_b);
    return of_a[i]->TokenStr() + ", a " + of_a[i]->GetModelType() + ", at byte " +
           std::to_string(place.in1 - bytes_a.begin()) + " of " + std::to_string(bytes_a.size());
  }
  return a->StateHash() == b->StateHash() ? "" : "the world's own state";
}

class SnapshotTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { Init(nullptr, nullptr); }
};

TEST_F(SnapshotTest, RestoredWorldsContinueUnchanged) {
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    const std::unique_ptr<World> world = LoadFile(file, 1);
    HashAfter(world.get(), kSteps);
    const uint64_t hash = world->StateHash();
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot));
    EXPECT_EQ(snapshot.time(), world->SimTimeNow());
    EXPECT_EQ(world->StateHash(), hash) << "taking it changes nothing";
    const uint64_t later = HashAfter(world.get(), kSteps);

    for (int round = 0; round < 2; round++) {
      ASSERT_TRUE(world->Restore(snapshot));
      EXPECT_EQ(world->StateHash(), hash);
      Snapshot again;
      ASSERT_TRUE(world->Take(&again));
      EXPECT_EQ(again.hash(), snapshot.hash());
      EXPECT_EQ(HashAfter(world.get(), kSteps), later) << "in place, " << round;
    }
    for (const int steps : {0, 7}) {
      const std::unique_ptr<World> other = LoadFile(file, 2);  // with another history
      HashAfter(other.get(), steps);
      ASSERT_TRUE(other->Restore(snapshot));
      EXPECT_EQ(other->StateHash(), hash) << steps;
      Snapshot again;
      ASSERT_TRUE(other->Take(&again));
      EXPECT_EQ(again.hash(), snapshot.hash()) << steps;
      EXPECT_EQ(HashAfter(other.get(), kSteps), later) << "in another world, " << steps;
    }
  }
}

TEST_F(SnapshotTest, TakingAndRestoringInEachStepChangesNothing) {
  for (const std::string& file : ShippedWorlds()) {
    const uint64_t undisturbed = HashAfter(LoadFile(file, 3).get(), kSteps / 2);
    const std::unique_ptr<World> world = LoadFile(file, 3);
    for (int i = 0; i < kSteps / 2; i++) {
      Snapshot snapshot;
      ASSERT_TRUE(world->Take(&snapshot));
      HashAfter(world.get(), i % 3);
      ASSERT_TRUE(world->Restore(snapshot)) << file;
      world->Update();
    }
    EXPECT_EQ(world->StateHash(), undisturbed) << file;
  }
}

/// After a step, the data that lean snapshots leave out is complete again.
TEST_F(SnapshotTest, LeanSnapshotsAreEquivalentAfterAStep) {
  for (const std::string& file : ShippedWorlds()) {
    SCOPED_TRACE(file);
    const std::unique_ptr<World> world = LoadFile(file, 1), other = LoadFile(file, 2);
    Snapshot first, middle, read;
    ASSERT_TRUE(world->Take(&first, Snapshot::kLean));
    HashAfter(world.get(), kFewSteps);
    ASSERT_TRUE(world->Take(&middle, Snapshot::kLean));
    std::stringstream written;
    ASSERT_TRUE(middle.Write(written) && read.Read(written));
    EXPECT_EQ(read.hash(), middle.hash());
    const uint64_t next = HashAfter(world.get(), 1), later = HashAfter(world.get(), kFewSteps);

    const std::unique_ptr<World> fresh = LoadFile(file, 2);
    HashAfter(other.get(), 7);
    for (World* const it : {world.get(), other.get(), fresh.get()}) {
      for (const Snapshot* from : {&middle, &first, &read}) {
        ASSERT_TRUE(it->Restore(*from));
        Snapshot again;
        ASSERT_TRUE(it->Take(&again, Snapshot::kLean));
        EXPECT_EQ(again.hash(), from->hash());
        if (from == &first) HashAfter(it, kFewSteps);
        EXPECT_EQ(HashAfter(it, 1), next);
        EXPECT_EQ(HashAfter(it, kFewSteps), later);
      }
    }
  }
}

/// A world in which a lean snapshot was restored keeps nothing of what it did before.
TEST_F(SnapshotTest, LeanSnapshotsRestoreNoPoseBeforeAPush) {
  std::istringstream text[2];
  std::unique_ptr<World> worlds[2];
  for (int i = 0; i < 2; i++) {
    text[i].str(
        "define box model( size [0.4 0.4 0.4] pushable 1 )\n"
        "box( name \"box\" pose [0.5 0 0 0] )\n"
        "position( name \"robot\" size [0.4 0.4 0.4] drive \"omni\" )\n");
    RunOptions options;
    options.listed = false;
    worlds[i] = std::make_unique<World>(options);
    ASSERT_TRUE(worlds[i]->Load(text[i], "push.world"));
    worlds[i]->GetModel("box")->Subscribe();  // it updates, so lean snapshots omit its readings
    auto* const robot = dynamic_cast<ModelPosition*>(worlds[i]->GetModel("robot"));
    robot->Subscribe();
    robot->SetSpeed(0.3, 0, 0);
  }
  Snapshot lean, full, again;
  ASSERT_TRUE(worlds[0]->Take(&lean, Snapshot::kLean));
  const double start = worlds[0]->GetModel("box")->GetPose().x;
  HashAfter(worlds[0].get(), 10);
  ASSERT_GT(worlds[0]->GetModel("box")->GetPose().x, start) << "it was pushed";
  for (int i = 0; i < 2; i++) ASSERT_TRUE(worlds[i]->Restore(lean));
  ASSERT_TRUE(worlds[0]->Take(&full) && worlds[1]->Take(&again));
  EXPECT_EQ(full.hash(), again.hash());
  EXPECT_EQ(HashAfter(worlds[0].get(), 3), HashAfter(worlds[1].get(), 3));
  ASSERT_TRUE(worlds[0]->Take(&full) && worlds[1]->Take(&again));
  EXPECT_EQ(full.hash(), again.hash()) << "the next step makes the pose again";
}

TEST_F(SnapshotTest, LeanSnapshotsAreSmall) {
  for (const std::string name : {"worlds/cave.world", "worlds/hospital.world"}) {
    const std::unique_ptr<World> world = LoadFile(SourceFile(name), 1);
    Snapshot snapshot;
    size_t robots = 0;
    for (const Model* model : all_models::ByNumber(world.get()))
      robots += dynamic_cast<const ModelPosition*>(model) != nullptr;
    for (int i = 0; i < 10; i++) {
      HashAfter(world.get(), 5);
      ASSERT_TRUE(world->Take(&snapshot, Snapshot::kLean));
      EXPECT_LE(snapshot.size(), 150 * robots) << name << " " << i;
      EXPECT_GT(snapshot.shared_size(), snapshot.size());
    }
  }
}

// ---- random operations --------------------------------------------------------------------------

/// Steps three worlds, two of which diverge and are restored several times, and compares them.
void GoAstrayAndBack(uint64_t seed, Snapshot::Keep keep) {
  constexpr int kAllSteps = 30;
  const std::unique_ptr<World> undisturbed = LoadRobotsOfAllTypes(seed),
                               world = LoadRobotsOfAllTypes(seed),
                               other = LoadRobotsOfAllTypes(seed + 1);
  test::RandomSource random(seed);
  Go(other.get(), seed + 7, 0, 5);
  for (int i = 0; i < kAllSteps;) {
    const int steps = random.Int(1, 6);
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot, keep));
    Go(world.get(), seed + 1000 + static_cast<uint64_t>(i), 0, random.Int(1, 5));  // diverges
    ASSERT_TRUE(world->Restore(snapshot));
    if (keep == Snapshot::kFull) {
      ASSERT_EQ(Difference(world.get(), undisturbed.get()), "") << i;
    }
    ASSERT_TRUE(other->Restore(snapshot));
    Go(undisturbed.get(), seed, i, steps);
    Go(world.get(), seed, i, steps);
    Go(other.get(), seed, i, steps);
    i += steps;
    ASSERT_EQ(Difference(world.get(), undisturbed.get()), "") << "in place, " << i;
    ASSERT_EQ(Difference(other.get(), undisturbed.get()), "") << "in another world, " << i;
  }
}

TEST_F(SnapshotTest, RestoreUndoesAllChanges) {
  constexpr int kWorlds = kSanitized ? 10 : 40;
  for (uint64_t seed = 0; seed < kWorlds && !HasFatalFailure(); seed++)
    for (const Snapshot::Keep keep : {Snapshot::kFull, Snapshot::kLean}) {
      SCOPED_TRACE(seed);
      SCOPED_TRACE(keep == Snapshot::kLean ? "lean" : "full");
      GoAstrayAndBack(seed, keep);
    }
}

/// One world simulates many futures alternately; each is the same as alone.
TEST_F(SnapshotTest, FuturesOfOneWorldAreIndependent) {
  constexpr uint64_t kFutures = 24;
  constexpr int kRounds = 4, kRound = 5, kTurns = kSanitized ? 60 : 2000;
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  std::vector<std::vector<uint64_t>> alone(kFutures);
  for (size_t future = 0; future < kFutures; future++) {
    const std::unique_ptr<World> own = LoadRobotsOfAllTypes(1);
    for (int round = 0; round < kRounds; round++) {
      Go(own.get(), future, round * kRound, kRound);
      Snapshot state;
      ASSERT_TRUE(own->Take(&state));
      alone[future].push_back(state.hash());
    }
  }
  std::vector<Snapshot> states(kFutures, now);
  std::vector<int> rounds(kFutures, 0);
  test::RandomSource random(1);
  for (int turn = 0; turn < kTurns; turn++) {
    const size_t future = static_cast<size_t>(random.Next() % kFutures);
    if (rounds[future] == kRounds) {
      rounds[future] = 0;
      states[future] = now;
    }
    ASSERT_TRUE(world->Restore(states[future]));
    Go(world.get(), future, rounds[future] * kRound, kRound);
    ASSERT_TRUE(world->Take(&states[future]));
    ASSERT_EQ(states[future].hash(), alone[future][static_cast<size_t>(rounds[future])])
        << "turn " << turn << ", future " << future << ", round " << rounds[future];
    rounds[future]++;
  }
}

/// After restoring, the id of a deleted model may be reused, but its name must not find another
/// model.
TEST_F(SnapshotTest, NamesOfDeletedModelsFindNothing) {
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  Snapshot now;
  ASSERT_TRUE(world->Take(&now));
  Model* const first = world->CreateModel(nullptr, "model");
  first->SetToken("first");
  delete first;
  ASSERT_TRUE(world->Restore(now));
  Model* const second = world->CreateModel(nullptr, "model");
  second->SetToken("second");
  EXPECT_EQ(world->GetModel("second"), second);
  ErrorsOf([&] { EXPECT_EQ(world->GetModel("first"), nullptr); });
}

// ---- errors -------------------------------------------------------------------------------------

int DoNothing(Model*, void*) { return 0; }

TEST_F(SnapshotTest, NamesStateThatCannotBeSaved) {
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  Snapshot snapshot;
  world->Enqueue(0, 1000000, world->GetModel("puck"), DoNothing, nullptr);
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(world->Take(&snapshot)); });
  EXPECT_EQ(errors,
            "stage: a snapshot can't be taken: a callback of Enqueue() is pending for \"puck\"\n");
  EXPECT_TRUE(snapshot.empty());
  EXPECT_NE(ErrorsOf([&] { EXPECT_FALSE(world->Restore(snapshot)); }).find("never taken"),
            std::string::npos);
}

TEST_F(SnapshotTest, FailedRestoreLeavesTheWorldUnchanged) {
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1), other = LoadRobotsOfAllTypes(1);
  Go(world.get(), 1, 0, 10);
  other->GetModel("a")->AddCallback(Model::CB_UPDATE, DoNothing, nullptr);
  Go(other.get(), 2, 0, 3);
  Snapshot snapshot;
  ASSERT_TRUE(other->Take(&snapshot));
  const uint64_t before = world->StateHash();
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(world->Restore(snapshot)); });
  EXPECT_NE(errors.find("callbacks"), std::string::npos) << errors;
  EXPECT_EQ(world->StateHash(), before);
  const std::unique_ptr<World> same = LoadRobotsOfAllTypes(1);
  Go(same.get(), 1, 0, 10);
  Go(same.get(), 1, 10, 5);
  Go(world.get(), 1, 10, 5);
  EXPECT_EQ(world->StateHash(), same->StateHash());
}

// ---- files --------------------------------------------------------------------------------------

std::string Written(const Snapshot& snapshot) {
  std::ostringstream out;
  EXPECT_TRUE(snapshot.Write(out));
  return out.str();
}

TEST_F(SnapshotTest, FilesAreComplete) {
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1), other = LoadRobotsOfAllTypes(2);
  Go(world.get(), 1, 0, 10);
  Snapshot snapshot, read;
  ASSERT_TRUE(world->Take(&snapshot));
  std::istringstream in(Written(snapshot));
  ASSERT_TRUE(read.Read(in));
  EXPECT_EQ(read.hash(), snapshot.hash());
  EXPECT_EQ(read.time(), snapshot.time());
  ASSERT_TRUE(other->Restore(read));
  EXPECT_EQ(Difference(other.get(), world.get()), "");
  std::istringstream nothing(Written(Snapshot()));
  ASSERT_TRUE(read.Read(nothing));
  EXPECT_TRUE(read.empty());
}

/// Stored snapshot files can be read, and give the stored state hash two seconds later. They are
/// named after their worlds. STAGE_NEW_SNAPSHOTS=1 rewrites them after a change of the format
/// version.
TEST_F(SnapshotTest, ReadsStoredFiles) {
  const std::filesystem::path folder = SourceFile("tests/data/snapshots");
  for (const std::string name : {"simple", "zoo"}) {
    const std::string world_file = SourceFile("worlds/" + name + ".world");
    const std::unique_ptr<World> world = LoadFile(world_file, 4);
    if (std::getenv("STAGE_NEW_SNAPSHOTS")) {
      HashAfter(world.get(), 30);
      Snapshot now;
      ASSERT_TRUE(world->Take(&now));
      std::ofstream file(folder / (name + ".snapshot"), std::ios::binary);
      ASSERT_TRUE(now.Write(file));
      std::ofstream(folder / (name + ".hash")) << HashAfter(world.get(), 20) << "\n";
    }
    std::ifstream file(folder / (name + ".snapshot"), std::ios::binary);
    Snapshot snapshot;
    ASSERT_TRUE(snapshot.Read(file, name));
    uint64_t expected = 0;
    std::ifstream(folder / (name + ".hash")) >> expected;
    const std::unique_ptr<World> other = LoadFile(world_file, 5);
    ASSERT_TRUE(other->Restore(snapshot));
    EXPECT_EQ(HashAfter(other.get(), 20), expected) << name;
  }
}

TEST_F(SnapshotTest, ImpossibleStatesAreHarmless) {
  const std::unique_ptr<World> world = LoadRobotsOfAllTypes(1);
  Go(world.get(), 1, 0, 10);
  Snapshot good;
  ASSERT_TRUE(world->Take(&good));
  const uint64_t hash = world->StateHash();
  const std::string file = Written(good);
  test::RandomSource random(1);
  int refused = 0, taken = 0;
  for (int i = 0; i < (kSanitized ? 200 : 1000); i++) {
    std::string bad = file;
    for (int k = random.Int(1, 3); k > 0; k--) {
      char& byte = bad[static_cast<size_t>(
          random.Between(snapshot_files::kHead, static_cast<int64_t>(bad.size()) - 9))];
      byte = static_cast<char>(random.OneIn(2) ? random.Next() : uint64_t{0xff} * random.OneIn(2));
    }
    Snapshot snapshot;
    std::istringstream in(snapshot_files::Signed(bad));
    bool is_read = false, went = false;
    std::string errors = ErrorsOf([&] { is_read = snapshot.Read(in); });
    if (!is_read) {
      EXPECT_NE(errors.find("found sections that don't fit"), std::string::npos) << errors;
      continue;
    }
    errors = ErrorsOf([&] { went = world->Restore(snapshot); });
    if (went) {
      taken++;
      try {
        world->Update();
      } catch (const std::bad_alloc&) {  // for example, a very wide picture
      }
      ASSERT_TRUE(world->Restore(good));
    } else {
      refused++;
      EXPECT_NE(errors.find("cannot restore the snapshot: "), std::string::npos) << errors;
    }
    ASSERT_EQ(world->StateHash(), hash) << i << " " << errors;
  }
  EXPECT_GT(refused, 20);
  EXPECT_GT(taken, 20);
}

}  // namespace
}  // namespace Stg
