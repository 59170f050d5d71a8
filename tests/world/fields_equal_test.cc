// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random worlds with fields: equal states with any number of threads, through snapshots, and in
// copies, branches, resets and pools.

#include <cmath>
#include <string>
#include <vector>

#include "models/types/field_values.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

/// A random world file.
class FieldText {
 public:
  explicit FieldText(uint64_t seed) : random_(seed) {
    text_ = "resolution 0.05\n";
    const int fields = 1 + Below(3);
    for (int i = 0; i < fields; i++) AddField(i);
    for (int i = 0; i < 12; i++) AddRobot(i, fields);
  }
  const std::string& text() const { return text_; }

 private:
  int Below(int n) { return static_cast<int>(random_.Next() % static_cast<uint64_t>(n)); }
  std::string Number(double low, double high) { return std::to_string(random_.Uniform(low, high)); }
  std::string Choice(const char* a, const char* b) { return Below(2) ? a : b; }

  void AddField(int i) {
    text_ += "field( name \"f" + std::to_string(i) + "\" size [" + Number(2, 9) + " " +
             Number(2, 9) + " 0] pose [" + Number(-1, 1) + " " + Number(-1, 1) + " 0 " +
             Number(-180, 180) + "] field_resolution " + Number(0.03, 0.2) + " edge " +
             Choice("\"closed\"", "\"open\"");
    if (Below(4)) text_ += " diffusion " + Number(0, 0.05);
    if (Below(4)) text_ += " evaporation " + Number(0, 0.5);
    if (Below(3) == 0) text_ += " initial " + Number(-3, 3);
    if (Below(3) == 0) text_ += " update_interval " + std::to_string(Below(400));
    text_ += " )\n";
  }

  void AddRobot(int i, int fields) {
    text_ += "position( name \"r" + std::to_string(i) + "\" size [0.3 0.3 0.3] pose [" +
             std::to_string(i % 4 * 0.9 - 1.4) + " " + std::to_string(i / 4 * 0.9 - 1) + " 0 " +
             Number(-180, 180) + "] alwayson 1\n";
    for (int k = 0; k < 2; k++) {
      text_ += "  groundsensor( alwayson 1 points 3 point[1] [" + Number(-0.2, 0.2) + " 0.1] " +
               "interpolation " + Choice("\"linear\"", "\"nearest\"");
      if (Below(2)) text_ += " field \"f" + std::to_string(Below(fields)) + "\"";
      if (Below(2)) text_ += " noise " + Number(0, 0.1);
      if (Below(2)) text_ += " deposit_rate " + Number(-1, 2);
      if (Below(3) == 0) text_ += " update_interval " + std::to_string(Below(400));
      text_ += " )\n";
    }
    text_ += ")\n";
  }

  RandomStream random_;
  std::string text_;
};

/// Drives and deposits by what the robot senses.
int Follow(Model* model, void*) {
  auto* const robot = static_cast<ModelPosition*>(model);
  const auto* const eye = dynamic_cast<ModelGroundSensor*>(robot->GetChildren()[0]);
  auto* const pen = dynamic_cast<ModelGroundSensor*>(robot->GetChildren()[1]);
  const double value = eye->GetValues().empty() ? 0 : eye->GetValues()[0];
  robot->SetSpeed(0.4, 0, value - std::floor(value) - 0.4);
  if (value > 0.2) pen->Deposit(0.1 * value);
  if (value < 0.1) pen->SetDepositRate(1 - value);
  return 0;
}

std::vector<ModelPosition*> RobotsOf(const World& world) {
  std::vector<ModelPosition*> robots;
  for (Model* model : world.GetAllModels())
    if (auto* const robot = dynamic_cast<ModelPosition*>(model)) robots.push_back(robot);
  return robots;
}

std::unique_ptr<World> LoadWith(const std::string& text, const RunOptions& options) {
  InitLibrary();
  auto world = std::make_unique<World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

std::vector<uint64_t> HashesOf(World* world, int steps) {
  std::vector<uint64_t> hashes;
  for (int i = 0; i < steps; i++) {
    EXPECT_FALSE(world->Update());
    EXPECT_EQ(world->Validate(), "");
    hashes.push_back(world->StateHash());
  }
  return hashes;
}

class Fields : public testing::TestWithParam<uint64_t> {};

TEST_P(Fields, AreEqualWithAnyNumberOfThreads) {
  const FieldText file(GetParam());
  std::vector<uint64_t> expected;
  for (const int threads : {1, 2, 3, 4}) {
    RunOptions options = OptionsOf(GetParam());
    options.threads = threads;
    options.share_from = threads == 1 ? 0 : 1;
    const auto world = LoadWith(file.text(), options);
    for (ModelPosition* robot : RobotsOf(*world))
      robot->AddParallelCallback(Model::CB_UPDATE, Follow, nullptr);
    const std::vector<uint64_t> hashes = HashesOf(world.get(), 25);
    if (threads == 1) expected = hashes;
    EXPECT_EQ(hashes, expected) << threads << '\n' << file.text();
  }
}

/// The world with robots that drive in circles.
std::unique_ptr<World> Begin(const FieldText& file, uint64_t seed) {
  auto world = LoadWith(file.text(), OptionsOf(seed));
  double turn = -1;
  for (ModelPosition* robot : RobotsOf(*world)) robot->SetSpeed(0.5, 0, turn += 0.2);
  return world;
}

TEST_P(Fields, AreEqualThroughSnapshotsAndCopies) {
  const FieldText file(GetParam());
  const auto world = Begin(file, GetParam());
  HashesOf(world.get(), 10);
  Snapshot middle;
  ASSERT_TRUE(world->Take(&middle));
  const uint64_t hash = world->StateHash();
  const std::vector<uint64_t> expected = HashesOf(world.get(), 10);
  ASSERT_TRUE(world->Restore(middle)) << "in place";
  EXPECT_EQ(world->StateHash(), hash);
  EXPECT_EQ(HashesOf(world.get(), 10), expected);

  World copy(OptionsOf(GetParam()));
  ASSERT_TRUE(copy.LoadCopy(*world));
  ASSERT_TRUE(copy.Restore(middle));
  EXPECT_EQ(HashesOf(&copy, 10), expected);

  const auto other = Begin(file, GetParam() + 1);
  HashesOf(other.get(), 3);
  ASSERT_TRUE(other->Restore(middle)) << "over other values";
  EXPECT_EQ(HashesOf(other.get(), 10), expected);
}

TEST_P(Fields, AreEqualInBranches) {
  const FieldText file(GetParam());
  const auto world = Begin(file, GetParam());
  HashesOf(world.get(), 5);
  Snapshot start;
  ASSERT_TRUE(world->Take(&start));
  BranchOptions options;
  options.threads = 2;
  Branches branches(*world, 3, options);
  EXPECT_NE(branches.WhyNotClosed().find("is a field"), std::string::npos)
      << branches.WhyNotClosed();
  for (uint32_t i = 0; i < 3; i++) branches.Restore(i, start);
  branches.Step(12);
  HashesOf(world.get(), 12);
  for (uint32_t i = 0; i < 3; i++)
    branches.Visit(i,
                   [&](World& of_branch) { EXPECT_EQ(of_branch.StateHash(), world->StateHash()); });
}

TEST_P(Fields, AreEqualAfterResets) {
  const FieldText file(GetParam());
  const auto world = LoadWith(file.text(), OptionsOf(1));
  HashesOf(world.get(), 6);
  ASSERT_TRUE(world->Reset(GetParam()));
  const auto fresh = LoadWith(file.text(), OptionsOf(GetParam()));
  EXPECT_EQ(HashesOf(world.get(), 8), HashesOf(fresh.get(), 8));
}

INSTANTIATE_TEST_SUITE_P(Random, Fields, testing::Range<uint64_t>(1, 13));

TEST(FieldThreads, ShareTheRowsOfALargeField) {
  std::vector<double> expected;
  for (const int threads : {1, 2, 4}) {
    RunOptions options = OptionsOf(1);
    options.threads = threads;
    options.share_from = threads == 1 ? 0 : 1;
    const auto world = LoadWith(
        "field( name \"f\" size [50 40 0] field_resolution 0.1 diffusion 0.08 evaporation 0.1\n"
        "  edge \"open\" )\nposition( alwayson 1 )\n",
        options);
    auto* const field = Find<ModelField>(*world, "f");
    RandomStream random(3);
    std::vector<double> values(field->values().size());
    for (double& value : values) value = random.Uniform(-1, 1);
    ASSERT_TRUE(field->SetValues(values.data(), values.size()));
    const uint64_t jobs = world->engine().shared_jobs();
    Step(*world, 20);
    if (threads > 1) {
      EXPECT_GT(world->engine().shared_jobs(), jobs + 20);
    }
    if (threads == 1) expected = field->values();
    EXPECT_EQ(field->values(), expected) << threads;
  }
}

TEST(FieldState, ContainsTheValuesThatDecideTheFuture) {
  const auto world = LoadText("field( name \"f\" size [1 1 0] )\ngroundsensor( name \"g\" )\n");
  auto* const field = Find<ModelField>(*world, "f");
  auto* const sensor = Find<ModelGroundSensor>(*world, "g");
  uint64_t hash = world->StateHash();
  const auto expect_change = [&](const char* what) {
    EXPECT_NE(world->StateHash(), hash) << what;
    hash = world->StateHash();
  };
  field->SetValue(0.1, 0.1, 2);
  expect_change("a value");
  field->SetValue(-0.1, 0.1, 2);
  expect_change("another cell of the row");
  field->SetDiffusion(0.1);
  expect_change("diffusion");
  field->SetEvaporation(0.1);
  expect_change("evaporation");
  sensor->Deposit(1);
  expect_change("a pending deposit");
  sensor->SetDepositRate(1);
  expect_change("a rate");
}

/// A row is skipped if all its values are 0, however it has got them.
TEST(FieldState, DoesNotDependOnHowValuesBecameZero) {
  const auto one = LoadText("field( name \"f\" size [1 1 0] )\n");
  const auto other = LoadText("field( name \"f\" size [1 1 0] )\n");
  Find<ModelField>(*one, "f")->SetValue(0, 0, 1);
  Find<ModelField>(*one, "f")->SetValue(0, 0, 0);
  EXPECT_EQ(one->StateHash(), other->StateHash());
}

TEST(FieldState, RefusesASnapshotOfAnotherSize) {
  const auto small = LoadText("field( name \"f\" size [1 1 0] )\n");
  const auto large = LoadText("field( name \"f\" size [1 2 0] )\n");
  Snapshot snapshot;
  ASSERT_TRUE(small->Take(&snapshot));
  const uint64_t hash = large->StateHash();
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(large->Restore(snapshot)); });
  EXPECT_NE(errors.find("the number of rows of a field"), std::string::npos) << errors;
  EXPECT_EQ(large->StateHash(), hash);
}

}  // namespace
}  // namespace Stg
