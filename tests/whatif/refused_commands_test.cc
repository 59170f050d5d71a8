// SPDX-License-Identifier: GPL-2.0-or-later
//
// A command that nobody obeys makes a branch fail, and a decision an error, with the reason.

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "stage.hh"
#include "support/device.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

const char kSeveral[] =
    "contacts \"cells\"\n"
    "position( name \"r\" alwayson 1 pose [0 0 0 0] size [0.3 0.3 0.3] )\n"
    "position( name \"idle\" pose [0 1 0 0] size [0.3 0.3 0.3] )\n"
    "position( name \"taxi\" alwayson 1 pose [0 2 0 0] size [0.3 0.3 0.3] drive \"car\" )\n"
    "position( name \"driven\" alwayson 1 pose [0 3 0 0] size [0.3 0.3 0.3] ctrl \"stage/goal "
    "x=2 y=3\" )\n"
    "model( name \"wall\" pose [3 0 0 0] size [0.1 9 1] )\n";

/// A command before step 2, with another addressee or other numbers.
struct Wrong {
  const char* to;  ///< null: no model
  Command::Kind kind;
  double x, y, a;
  const char* why;
};

const Wrong kWrong[] = {
    {nullptr, Command::kSetSpeed, 1, 0, 0,
     "to model 4000 is refused: there is no such model; take its number from Model::GetId()"},
    {"wall", Command::kStop, 0, 0, 0, "to \"wall\" is refused: it is a model, expected a position"},
    {"idle", Command::kSetSpeed, 1, 0, 0,
     "to \"idle\" is refused: it stands because it has no subscribers; Subscribe() to it before "
     "World::Take(), or give it alwayson 1 in the world file"},
    {"idle", Command::kGoTo, 0, 0, 0,
     "to \"idle\" is refused: it stands because it has no subscribers; Subscribe() to it before "
     "World::Take(), or give it alwayson 1 in the world file"},
    {"r", Command::kSetSpeed, 0, kNaN, 0, "to \"r\" is refused: a number is missing (NaN)"},
    {"r", Command::kSetAcceleration, 0, 0, kNaN, "to \"r\" is refused: a number is missing (NaN)"},
    {"r", Command::kGoTo, kInfinite, 0, 0, "to \"r\" is refused: the goal is not finite"},
    {"taxi", Command::kGoTo, 1, 0, 0,
     "to \"taxi\" is refused: it is a car, which obeys kSetSpeed and kStop only"},
    {"taxi", Command::kSetAcceleration, 1, 0, 0,
     "to \"taxi\" is refused: it is a car, which obeys kSetSpeed and kStop only"},
    {"driven", Command::kStop, 0, 0, 0,
     "to \"driven\" is refused: its controller replaces each command; take it out of `ctrl` in "
     "the world file of the branches"},
};

Command CommandOf(const World& world, const Wrong& wrong) {
  return {2,      wrong.to ? world.GetModel(wrong.to)->GetId() : 4000, wrong.kind, wrong.x, wrong.y,
          wrong.a};
}

std::unique_ptr<World> LoadEndless(const std::string& text) {
  InitLibrary();
  auto world = LoadText(text, 1);
  world->SetQuitTime(0);
  return world;
}

Snapshot Now(const World& world) {
  Snapshot now;
  EXPECT_TRUE(world.Take(&now));
  return now;
}

void ExpectRefusals(const BranchOptions& options) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  const Snapshot now = Now(*world);
  const auto count = static_cast<uint32_t>(std::size(kWrong));
  Branches branches(*world, count + 1, options);
  for (uint32_t i = 0; i <= count; i++) branches.Restore(i, now);
  for (uint32_t i = 0; i < count; i++) branches.Give(i, CommandOf(*world, kWrong[i]));
  branches.Step(5);
  for (uint32_t i = 0; i < count; i++) {
    EXPECT_EQ(branches[i].error, std::string("the command before step 2 ") + kWrong[i].why);
    EXPECT_EQ(branches[i].state, Branch::kFailed);
    EXPECT_TRUE(branches[i].refused);
    EXPECT_EQ(branches[i].steps, 2u);
    EXPECT_TRUE(branches.StateOf(i).empty());
  }
  EXPECT_EQ(branches[count].state, Branch::kAlive) << "the others go on";
  EXPECT_EQ(branches[count].steps, 5u);
  branches.Restore(0, now);
  branches.Step(5);
  EXPECT_FALSE(branches[0].refused);
  EXPECT_EQ(branches[0].error, "");
}

TEST(RefusedCommands, MakeABranchFailWithAReason) {
  BranchOptions options;
  ExpectRefusals(options);
  options.rows = false;
  ExpectRefusals(options);
}

TEST(RefusedCommands, MakeABranchOnADeviceFailWithTheSameReason) {
  if (!device::WhyNone().empty()) GTEST_SKIP() << device::WhyNone();
  BranchOptions options;
  options.device_steps = true;
  ExpectRefusals(options);
}

TEST(RefusedCommands, ARobotThatStandsMayBeToldToStand) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  const uint32_t idle = world->GetModel("idle")->GetId();
  for (const bool rows : {true, false}) {
    BranchOptions options;
    options.rows = rows;
    Branches branches(*world, 1, options);
    branches.Restore(0, Now(*world));
    branches.Give(0, {0, idle, Command::kStop});
    branches.Give(0, {1, idle, Command::kSetSpeed, 0, 0, 0});
    branches.Step(3);
    EXPECT_EQ(branches[0].error, "");
  }
}

TEST(RefusedCommands, ACommandMustNotComeTooLate) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  const uint32_t robot = world->GetModel("r")->GetId();
  Branches branches(*world, 2);
  for (const uint32_t i : {0u, 1u}) branches.Restore(i, Now(*world));
  branches.Step(3);
  branches.Give(0, {3, robot, Command::kSetSpeed, 0.5});
  branches.Give(1, {2, robot, Command::kSetSpeed, 0.5});
  branches.Step(2);
  EXPECT_EQ(branches[0].error, "");
  EXPECT_TRUE(branches[1].refused);
  EXPECT_EQ(branches[1].error, "the command before step 2 to model " + std::to_string(robot) +
                                   " is refused: 3 steps have been made already");
}

TEST(RefusedCommands, ADisabledRobotDoesNotObey) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  world->GetModel("r")->Disable();
  Branches branches(*world, 1);
  branches.Restore(0, Now(*world));
  branches.Give(0, {0, world->GetModel("r")->GetId(), Command::kSetSpeed, 0.5});
  branches.Step(2);
  EXPECT_EQ(branches[0].error,
            "the command before step 0 to \"r\" is refused: it stands because it is disabled; "
            "Enable() it before World::Take()");
}

/// Subscribes to a robot before the first step.
class Subscriber : public Scenario {
  void BeforeStep(World& world, uint32_t) override {
    if (world.UpdateCount() == 0) world.GetModel("idle")->Subscribe();
  }
};

TEST(RefusedCommands, AScenarioMaySubscribe) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  BranchOptions options;
  options.watched = {world->GetModel("idle")->GetId()};
  Branches branches(*world, 1, options);
  branches.Restore(0, Now(*world));
  branches.Give(0, {0, options.watched[0], Command::kSetSpeed, 0.5});
  Subscriber scenario;
  branches.Step(2, &scenario);
  EXPECT_EQ(branches[0].error, "");
  EXPECT_GT(branches[0].sightings.back().pose.x, 0.01);
}

// ---- controllers --------------------------------------------------------------------------------

int SetHalf(Model* model, void*) {
  dynamic_cast<ModelPosition*>(model)->SetSpeed(0.5, 0, 0);
  return 0;
}

int SetHalfLater(Model* model, void* arg) {
  return model->GetWorld()->UpdateCount() < 20 ? 0 : SetHalf(model, arg);
}

int SetHalfOfR(Model* model, void* arg) { return SetHalf(model->GetWorld()->GetModel("r"), arg); }

int DoNothing(Model*, void*) { return 0; }

template <int (*update)(Model*, void*)>
int InitWith(Model* model, CtrlArgs*) {
  model->DeclareNoState("test");
  model->AddCallback(Model::CB_UPDATE, update, nullptr);
  model->Subscribe();
  return 0;
}

int InitWithState(Model* model, CtrlArgs*) {
  model->AddCallback(Model::CB_UPDATE, DoNothing, nullptr);
  return 0;
}

const bool kRegistered = RegisterController("overrides", InitWith<SetHalf>) &&
                         RegisterController("overrides_later", InitWith<SetHalfLater>) &&
                         RegisterController("overrides_r", InitWith<SetHalfOfR>) &&
                         RegisterController("looks", InitWith<DoNothing>) &&
                         RegisterController("forgets", InitWithState);

/// A world with a robot that has a controller, and another robot, which is farther away.
std::unique_ptr<World> WorldWith(const std::string& of_r, const std::string& of_other = "") {
  EXPECT_TRUE(kRegistered);
  return LoadEndless("position( name \"r\" alwayson 1 size [0.3 0.3 0.3] " + of_r +
                     "\n  ranger( alwayson 1 pose [0 0 -0.2 0] update_interval 300 sensor( range "
                     "[0 3] samples 3 ) ) )\n"
                     "position( name \"other\" alwayson 1 pose [0 3 0 0] size [0.3 0.3 0.3] " +
                     of_other + " )\n");
}

/// Gives r commands before these steps, makes 30 steps, and returns the error.
std::string ErrorOf(const World& world, const std::vector<uint64_t>& steps) {
  Branches branches(world, 1);
  branches.Restore(0, Now(world));
  for (const uint64_t step : steps)
    branches.Give(0, {step, world.GetModel("r")->GetId(), Command::kSetSpeed, 0.1});
  for (int i = 0; i < 6; i++) branches.Step(5);
  EXPECT_EQ(branches[0].refused, !branches[0].error.empty());
  return branches[0].error;
}

const char kReplaced[] =
    "the command before step 4 to \"r\" is refused: a controller has replaced it; take that out of "
    "`ctrl` in the world file of the branches, or tell it what to do in Scenario::BeforeStep() or "
    "Judge::Begin()";

TEST(RefusedCommands, AControllerThatReplacesACommandIsAnError) {
  EXPECT_EQ(ErrorOf(*WorldWith("ctrl \"overrides\""), {4}), kReplaced);
  EXPECT_EQ(ErrorOf(*WorldWith("", "ctrl \"overrides_r\""), {4}), kReplaced)
      << "the controller of another robot";
}

TEST(RefusedCommands, AControllerMayReplaceACommandThatWasObeyedForAWhile) {
  EXPECT_EQ(ErrorOf(*WorldWith("ctrl \"overrides_later\""), {4}), "");
  EXPECT_EQ(ErrorOf(*WorldWith("ctrl \"looks\""), {4}), "");
  EXPECT_EQ(ErrorOf(*WorldWith("", "ctrl \"overrides\""), {4}), "");
  EXPECT_EQ(ErrorOf(*WorldWith("ctrl \"overrides_later\""), {17}), "");
  EXPECT_NE(ErrorOf(*WorldWith("ctrl \"overrides_later\""), {18}).find("before step 18"),
            std::string::npos)
      << "the ranger updates every third step, and the controller replaces it in step 20";
}

TEST(RefusedCommands, ACommandForEachStepLeavesNothingToAController) {
  std::vector<uint64_t> all;
  for (uint64_t step = 0; step < 30; step++) all.push_back(step);
  EXPECT_EQ(ErrorOf(*WorldWith("ctrl \"overrides\""), all), "");
  all.erase(all.begin() + 5);
  EXPECT_EQ(ErrorOf(*WorldWith("ctrl \"overrides\""), all), kReplaced);
}

/// Drives r by its own decision in each step.
class Driver : public Scenario {
  void BeforeStep(World& world, uint32_t) override { SetHalf(world.GetModel("r"), nullptr); }
};

TEST(RefusedCommands, AScenarioMayReplaceThem) {
  const std::unique_ptr<World> world = WorldWith("");
  Branches branches(*world, 1);
  branches.Restore(0, Now(*world));
  branches.Give(0, {0, world->GetModel("r")->GetId(), Command::kSetSpeed, 0.1});
  Driver driver;
  branches.Step(5, &driver);
  EXPECT_EQ(branches[0].error, "");
}

// ---- decisions ----------------------------------------------------------------------------------

/// Scores how far east the first watched model gets.
class Eastward : public Judge {
 public:
  bool NeedsWorld() const override { return false; }
  bool Watch(const Sighting* watched, size_t, double* score) override {
    *score = watched[0].pose.x;
    return false;
  }
};

Question QuestionAbout(const World& world, const std::string& other) {
  const uint32_t robot = world.GetModel("r")->GetId();
  Question question;
  question.now = Now(world);
  question.horizon = 2000000;
  question.candidates.push_back({"go on", {}});
  question.candidates.push_back({"ahead",
                                 {{0, robot, Command::kSetSpeed, 0.5},
                                  {7, world.GetModel(other)->GetId(), Command::kSetSpeed, 0.5}}});
  return question;
}

TEST(RefusedCommands, ADecisionWithThemIsAnErrorThatNamesTheCandidate) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  ConsequenceEngine::Options options;
  options.watched = {world->GetModel("r")->GetId()};
  options.samples = 3;
  for (const bool rows : {true, false}) {
    options.rows = rows;
    ConsequenceEngine engine(*world, options);
    Eastward judge;
    const Question question = QuestionAbout(*world, "idle");
    const Decision decision = engine.Choose(question, Budget(), &judge);
    EXPECT_EQ(
        decision.error,
        "candidate 1 (\"ahead\"): the command before step 7 to \"idle\" is refused: it stands "
        "because it has no subscribers; Subscribe() to it before World::Take(), or give it "
        "alwayson 1 in the world file");
    EXPECT_FALSE(decision.complete);
    EXPECT_EQ(decision.outcomes[1].error.find("the command before step 7"), 0u);
    EXPECT_EQ(decision.outcomes[0].error, "");
    EXPECT_EQ(engine.Replay(question, decision, &judge).error, decision.error);
    const Decision right = engine.Choose(QuestionAbout(*world, "taxi"), Budget(), &judge);
    EXPECT_EQ(right.error, "") << "the engine forgets the error";
    EXPECT_EQ(right.best, 1u);
  }
}

TEST(RefusedCommands, ABeliefInARobotThatItsControllerDrivesIsAnError) {
  const std::string file = testing::TempDir() + "refused_commands.world";
  std::ofstream(file) << "contacts \"cells\"\n"
                         "position( name \"r\" size [0.3 0.3 0.3] ctrl \"stage/goal x=2 y=3\" )\n";
  InitLibrary();
  Belief belief(file, "r");
  ASSERT_TRUE(belief.IsReady());
  BeliefEngine engine(&belief);
  BeliefQuestion question;
  question.plans = {Plan("ahead", Velocity(0.5, 0, 0, 0))};
  GoalJudge judge(5, 0, 0.2);
  EXPECT_EQ(engine.Choose(question, Budget(), &judge).error,
            "candidate 0 (\"ahead\"): the command before step 0 to \"r\" is refused: its "
            "controller replaces "
            "each command; take it out of `ctrl` in the world file of the branches");
}

TEST(RefusedCommands, ADecisionOfFailedCandidatesIsAnError) {
  const std::unique_ptr<World> world = LoadEndless(kSeveral);
  ConsequenceEngine::Options options;
  options.watched = {world->GetModel("r")->GetId()};
  ConsequenceEngine engine(*world, options);
  Eastward judge;
  Question question = QuestionAbout(*world, "taxi");
  question.now = Snapshot();
  EXPECT_EQ(engine.Choose(question, Budget(), &judge).error,
            "all candidates have failed; candidate 0 (\"go on\"): the snapshot was never taken, or "
            "World::Take() has refused it");
}

TEST(RefusedCommands, AControllerThatCannotBeKeptIsAnError) {
  const std::unique_ptr<World> world = WorldWith("ctrl \"forgets\"");
  Snapshot now;
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(world->Take(&now)); });
  EXPECT_NE(errors.find("a controller of \"r\" does not declare its state with KeepState() or "
                        "DeclareNoState()"),
            std::string::npos)
      << errors;
  ConsequenceEngine::Options options;
  options.watched = {world->GetModel("r")->GetId()};
  ConsequenceEngine engine(*world, options);
  Eastward judge;
  Question question;
  question.horizon = 1000000;
  question.now = now;
  question.candidates.push_back({"go on", {}});
  EXPECT_NE(engine.Choose(question, Budget(), &judge).error, "");
}

}  // namespace
}  // namespace Stg
