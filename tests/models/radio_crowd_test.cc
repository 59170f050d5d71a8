// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random crowds of radios: what they hear equals what a comparison of all pairs gives, and does not
// depend on threads, snapshots or branches.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/trigonometry.hh"
#include "radio_testing.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "whatif/branches.hh"
#include "world/snapshot.hh"

namespace Stg {
namespace {

using test::RandomSource;

// ---- random crowds ------------------------------------------------------------------------------

/// How the radios of a crowd are spread, and how far they are heard.
struct Kind {
  const char* name;
  double extent;               // metres
  std::vector<double> ranges;  // metres
};

const Kind kKinds[] = {{"spread", 10, {0, 0.5, 1, 2}},
                       {"all in one cell", 1e-4, {0, 5e-5, 1e-4, 1}},
                       {"at one place", 0, {0, 1}},
                       {"very large ranges", 10, {1e9, HUGE_VAL, 1e-300}},
                       {"ranges of all sizes", 100, {1e-6, 0.01, 0.3, 4, 60, 900}},
                       {"far from the origin", 10, {0.5, 1, 2}},
                       {"on a lattice", 8, {0.25, 0.5, 1, 2}}};

constexpr int kRadios = 40;

std::string CrowdText(uint64_t seed) {
  RandomSource random(seed);
  // Odd seeds: with noise, and with radios that keep messages until they update.
  const std::string noise =
      seed % 2 == 1 ? " loss 0.3 range_noise 0.1 bearing_noise 5 update_interval 200" : "";
  std::ostringstream text;
  text << "resolution 0.05\n" << (seed % 3 == 0 ? "ray_model \"exact\"\n" : "");
  for (int i = 0; i < 8; i++)
    text << "model( pose [" << random.Real(-8, 8) << " " << random.Real(-8, 8)
         << " 0 30] size [1 0.2 1] )\n";
  for (int i = 0; i < kRadios; i++)
    text << "model( name \"m" << i << "\" size [0.1 0.1 0.2]\n  radio( name \"r\" pose [0.02 0 0 "
         << random.Int(-180, 180) << "] alwayson " << !random.OneIn(8) << " line_of_sight "
         << random.OneIn(2) << " channel " << random.Int(0, 1) << " delay "
         << random.Pick(std::vector<int>{0, 0, 0, 1, 3}) << " collisions " << random.OneIn(4)
         << " capacity " << random.Pick(std::vector<int>{1, 3, 64, 64}) << noise << " ) )\n";
  return text.str();
}

std::unique_ptr<World> LoadCrowd(uint64_t seed, int threads = 1) {
  InitLibrary();
  RunOptions options;
  options.threads = threads;
  options.share_from = 1;
  auto world = std::make_unique<World>(options);
  std::istringstream content(CrowdText(seed));
  EXPECT_TRUE(world->Load(content, "crowd.world"));
  return world;
}

/// The radios of a crowd that still exist.
std::vector<ModelRadio*> RadiosOf(const World& world) {
  std::vector<ModelRadio*> radios;
  for (Model* model : world.GetAllModels())
    if (auto* const radio = dynamic_cast<ModelRadio*>(model)) radios.push_back(radio);
  std::ranges::sort(radios, {}, &Model::GetId);
  return radios;
}

Pose RandomPose(const Kind& kind, RandomSource* random) {
  double x = random->Real(-kind.extent, kind.extent), y = random->Real(-kind.extent, kind.extent);
  if (kind.name == std::string("on a lattice")) {
    x = std::floor(x * 4) / 4;
    y = std::floor(y * 4) / 4;
  }
  if (kind.name == std::string("far from the origin")) x += 1e5;
  return Pose(x, y, 0, random->Real(-4, 4));
}

struct Sent {
  ModelRadio* sender;
  usec_t due;
  int channel;
  std::string bytes;
};

/// Places all radios anew and sends random messages, as determined by the seed and the time.
/// Returns these messages.
std::vector<Sent> Disturb(const Kind& kind, uint64_t seed, World* world) {
  RandomSource random(seed * 1000 + world->SimTimeNow() / 100000);
  std::vector<Sent> all;
  for (ModelRadio* radio : RadiosOf(*world)) {
    radio->Root()->SetPose(RandomPose(kind, &random));
    radio->range = random.Pick(kind.ranges);
    for (int k = random.Int(0, 2); k > 0; k--) {
      std::string bytes(static_cast<size_t>(random.Int(0, 64)), ' ');
      for (char& byte : bytes) byte = static_cast<char>(random.Int(-128, 127));
      EXPECT_TRUE(SendText(radio, bytes));
      all.push_back({radio, world->SimTimeNow() + 100000 * (radio->delay + 1), radio->channel,
                     std::move(bytes)});
    }
  }
  return all;
}

void Go(const Kind& kind, uint64_t seed, World* world, int steps) {
  for (int i = 0; i < steps; i++) {
    Disturb(kind, seed, world);
    ASSERT_FALSE(world->Update());
  }
}

// ---- comparison with all pairs ------------------------------------------------------------------

bool Blocks(Model* candidate, const Model* sender, const void* receiver) {
  return candidate->vis.ranger_return >= 0 && candidate->Root() != sender->Root() &&
         candidate->Root() != static_cast<const Model*>(receiver)->Root();
}

/// A message that a radio hears according to the definition, and its measurements.
struct Expected {
  double distance, bearing;
  const Sent* sent;
};

std::vector<Expected> ExpectedOf(const ModelRadio& receiver, const std::vector<Sent>& on_air,
                                 World* world) {
  const Pose here = receiver.GetGlobalPose();
  std::vector<Expected> heard;
  for (const Sent& sent : on_air) {
    const ModelRadio& sender = *sent.sender;
    const Pose there = sender.GetGlobalPose();
    const double dx = there.x - here.x, dy = there.y - here.y;
    const double distance = std::sqrt(dx * dx + dy * dy);
    if (&sender == &receiver || sent.channel != receiver.channel || !(distance <= sender.range))
      continue;
    const Pose ray(there.x, there.y, there.z, ArcTangent(-dy, -dx));
    if (sender.line_of_sight &&
        world->Raytrace(ray, distance, Blocks, &sender, &receiver, true).mod)
      continue;
    heard.push_back({distance, normalize(ArcTangent(dy, dx) - here.a), &sent});
  }
  std::ranges::stable_sort(heard, {}, &Expected::distance);  // equally near ones are by id already
  const auto is_first = [&](const Expected& e) { return e.sent->sender == heard[0].sent->sender; };
  if (receiver.collisions && !std::ranges::all_of(heard, is_first)) heard.clear();
  if (heard.size() > receiver.capacity) heard.resize(receiver.capacity);
  return heard;
}

/// Returns the number of messages.
size_t ExpectHeard(const ModelRadio& receiver, const std::vector<Expected>& expected) {
  const auto& received = receiver.Received();
  EXPECT_EQ(received.size(), expected.size());
  for (size_t i = 0; i < std::min(received.size(), expected.size()); i++) {
    EXPECT_EQ(received[i].sender, expected[i].sent->sender->GetId());
    EXPECT_EQ(TextOf(received[i]), expected[i].sent->bytes);
    EXPECT_EQ(received[i].range, expected[i].distance);
    EXPECT_EQ(received[i].bearing, expected[i].bearing);
  }
  return received.size();
}

TEST(RadioCrowd, HearsWhatAComparisonOfAllPairsGives) {
  for (const Kind& kind : kKinds) {
    size_t heard = 0;
    for (const uint64_t seed : {0u, 2u, 4u, 6u}) {  // even: without noise
      const std::unique_ptr<World> world = LoadCrowd(seed);
      std::vector<Sent> under_way;
      for (int step = 0; step < (kSanitized ? 5 : 20) && !testing::Test::HasFailure(); step++) {
        for (Sent& sent : Disturb(kind, seed, world.get())) under_way.push_back(std::move(sent));
        ASSERT_FALSE(world->Update());
        std::vector<Sent> on_air;
        for (const Sent& sent : under_way)
          if (sent.due == world->SimTimeNow()) on_air.push_back(sent);
        // By sender, and in the order of sending.
        std::ranges::stable_sort(on_air, {}, [](const Sent& sent) { return sent.sender->GetId(); });
        for (const ModelRadio* radio : RadiosOf(*world))
          if (radio->HasSubscribers())
            heard += ExpectHeard(*radio, ExpectedOf(*radio, on_air, world.get()));
      }
    }
    EXPECT_GT(heard, 100u) << kind.name;
  }
}

// ---- the same however it is run -----------------------------------------------------------------

TEST(RadioCrowd, IsEqualOnAnyNumberOfThreads) {
  for (const Kind& kind : kKinds)
    for (uint64_t seed = 0; seed < (kSanitized ? 2 : 6); seed++) {
      const std::unique_ptr<World> one = LoadCrowd(seed), two = LoadCrowd(seed, 2),
                                   four = LoadCrowd(seed, 4);
      for (int step = 0; step < 8; step++) {
        for (World* world : {one.get(), two.get(), four.get()}) Go(kind, seed, world, 1);
        ASSERT_EQ(one->StateHash(), two->StateHash()) << kind.name << seed << " " << step;
        ASSERT_EQ(one->StateHash(), four->StateHash()) << kind.name << seed << " " << step;
      }
      EXPECT_EQ(one->Validate(), "");
    }
}

TEST(RadioCrowd, ContinuesFromSnapshotsAndBytes) {
  for (const Kind& kind : kKinds)
    for (uint64_t seed = 0; seed < 4; seed++) {
      const std::unique_ptr<World> world = LoadCrowd(seed), other = LoadCrowd(seed);
      Go(kind, seed, world.get(), 5);
      Snapshot snapshot, read;
      ASSERT_TRUE(world->Take(&snapshot));
      std::stringstream bytes;
      ASSERT_TRUE(snapshot.Write(bytes) && read.Read(bytes));
      Go(kind, seed, world.get(), 4);
      for (const Snapshot* from : {&snapshot, &read}) {
        Go(kind, seed + 1, other.get(), 2);  // a past of its own
        ASSERT_TRUE(other->Restore(*from));
        Go(kind, seed, other.get(), 4);
        EXPECT_EQ(other->StateHash(), world->StateHash()) << kind.name << seed;
      }
    }
}

/// Disturbs branches as the crowd is disturbed.
class Disturbing : public Scenario {
 public:
  Disturbing(const Kind& kind, uint64_t seed) : kind_(kind), seed_(seed) {}
  bool AfterStep(World& world, uint32_t, double*) override {
    Disturb(kind_, seed_, &world);
    return false;
  }

 private:
  const Kind& kind_;
  const uint64_t seed_;
};

TEST(RadioCrowd, ContinuesInBranches) {
  for (const Kind& kind : kKinds)
    for (uint64_t seed = 0; seed < 4; seed++) {
      const std::unique_ptr<World> world = LoadCrowd(seed);
      Go(kind, seed, world.get(), 3);
      Disturb(kind, seed, world.get());
      Snapshot start, end;
      ASSERT_TRUE(world->Take(&start));
      Branches branches(*world, 3);
      Disturbing disturbing(kind, seed);
      for (uint32_t i = 0; i < 3; i++) branches.Restore(i, start);
      branches.Step(5, &disturbing);
      for (int step = 0; step < 5; step++) {
        ASSERT_FALSE(world->Update());
        Disturb(kind, seed, world.get());
      }
      ASSERT_TRUE(world->Take(&end));
      for (uint32_t i = 0; i < 3; i++) {
        EXPECT_EQ(branches[i].state, Branch::kAlive) << branches[i].error;
        EXPECT_EQ(branches.StateOf(i).hash(), end.hash()) << kind.name << seed;
      }
    }
}

TEST(RadioCrowd, SurvivesDeletions) {
  for (uint64_t seed = 0; seed < 6; seed++) {
    const std::unique_ptr<World> one = LoadCrowd(seed), two = LoadCrowd(seed, 3);
    for (int step = 0; step < 20; step++) {
      for (World* world : {one.get(), two.get()}) {
        Disturb(kKinds[0], seed, world);
        const std::vector<ModelRadio*> radios = RadiosOf(*world);
        delete radios[static_cast<size_t>(step) * 7 % radios.size()]->Root();
        ASSERT_FALSE(world->Update());
        ASSERT_EQ(world->Validate(), "");
      }
      ASSERT_EQ(one->StateHash(), two->StateHash()) << seed << " " << step;
    }
  }
}

TEST(RadioCrowd, ResetsToTheStart) {
  const std::unique_ptr<World> fresh = LoadCrowd(1), used = LoadCrowd(1);
  Go(kKinds[0], 9, used.get(), 5);
  ASSERT_TRUE(used->Reset(used->seed()));
  for (World* world : {fresh.get(), used.get()}) Go(kKinds[0], 1, world, 5);
  EXPECT_EQ(used->StateHash(), fresh->StateHash());
}

/// Another seed gives other noise.
TEST(RadioCrowd, DependsOnTheSeed) {
  const std::unique_ptr<World> world = LoadCrowd(1);
  std::vector<uint64_t> hashes;
  for (const uint64_t seed : {5u, 5u, 6u}) {
    ASSERT_TRUE(world->Reset(seed));
    Go(kKinds[0], 1, world.get(), 3);
    double sum = 0;
    for (const ModelRadio* radio : RadiosOf(*world))
      for (const auto& message : radio->Received()) sum += message.range;
    hashes.push_back(static_cast<uint64_t>(sum * 1e9));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_NE(hashes[0], hashes[2]);
}

}  // namespace
}  // namespace Stg
