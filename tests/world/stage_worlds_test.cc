// SPDX-License-Identifier: GPL-2.0-or-later
//
// World files of Stage's users, if they are available (STAGE_SHARED_DIR). Each loads and runs, or
// fails with the message in this list, so the list is always up to date.

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "support/model_testing.hh"

namespace Stg {
namespace {

struct StageWorld {
  const char* file;
  size_t models;        ///< number of models, including the ground; 0: it can't be loaded
  const char* place;    ///< place of the error: file:line:column
  const char* message;  ///< beginning of the error
};

// Files with 0 models contain errors that will not be fixed.
const StageWorld kWorlds[] = {
    {"benchmark/cave.world", 302, nullptr, nullptr},
    {"benchmark/hospital.world", 2002, nullptr, nullptr},
    {"pioneer_follow.world", 5, nullptr, nullptr},
    {"sensor_noise_demo.world", 5, nullptr, nullptr},
    {"simple.world", 8, nullptr, nullptr},
    {"camera.world", 6, nullptr, nullptr},
    {"everything.world", 58, nullptr, nullptr},
    {"roomba.world", 4, nullptr, nullptr},
    // These files test the parser of an old Stage and use obsolete model types.
    {"tests/macro-01.world", 0, "tests/macro-01.world:24:1", "found \"environment\", expected"},
    {"tests/macro-02.world", 0, "tests/macro-02.world:27:1", "found \"environment\", expected"},
    {"tests/syntax-01.world", 0, "tests/syntax-01.world:10:1", "found \"environment\", expected"},
    {"tests/include-01.world", 0, "tests/include-01.world:11:1", "found \"environment\", expected"},
    {"tests/include-02.world", 0, "tests/include-02.world:9:9",
     "syntax error in include statement"},
    // Stage 4.3 counts a line end between a name and its parenthesis twice. The correct lines are
    // here.
    {"tests/syntax-02.world", 0, "tests/syntax-02.world:14:10", "syntax error"},
    {"tests/syntax-03.world", 0, "tests/syntax-03.world:19:1", "missing ')'"},
    {"tests/syntax-04.world", 0, "tests/syntax-04.world:16:1", "syntax error"},
    {"tests/syntax-05.world", 0, "tests/syntax-05.world:16:1", "syntax error"},
    {"tests/syntax-06.world", 0, "tests/syntax-06.world:12:8", "syntax error"},
    {"tests/syntax-07.world", 0, "tests/syntax-07.world:9:1", "missing name in macro definition"},
};

void PrintTo(const StageWorld& world, std::ostream* out) { *out << world.file; }

/// The folder of the worlds; empty if it is not available.
std::string WorldsFolder() {
  const char* shared = std::getenv("STAGE_SHARED_DIR");
  return shared ? std::string(shared) + "/stage-worlds/" : "";
}

class StageWorlds : public testing::TestWithParam<StageWorld> {
 protected:
  void SetUp() override {
    if (WorldsFolder().empty()) GTEST_SKIP() << "STAGE_SHARED_DIR is not set: no worlds to load";
  }
};

TEST_P(StageWorlds, LoadAndRunOrSayWhyNot) {
  const StageWorld& expected = GetParam();
  const auto world = EmptyWorld();
  bool loaded = false;
  const std::string errors =
      ErrorsOf([&] { loaded = world->Load(WorldsFolder() + expected.file); });
  EXPECT_EQ(loaded, expected.models > 0) << errors;
  if (expected.models > 0) {
    EXPECT_EQ(world->LoadStatus(), 0);
    EXPECT_EQ(world->GetAllModels().size(), expected.models);
    world->SetQuitTime(60000000);
    while (!world->Update()) {
    }
    EXPECT_EQ(world->SimTimeNow(), 60000000u);
    return;
  }
  EXPECT_EQ(world->LoadStatus(), 1);
  EXPECT_EQ(world->GetAllModels().size(), 1u);
  const std::string start = WorldsFolder() + expected.place + ": " + expected.message;
  EXPECT_EQ(errors.compare(0, start.size(), start), 0) << errors;
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
}

INSTANTIATE_TEST_SUITE_P(Files, StageWorlds, testing::ValuesIn(kWorlds), [](const auto& test) {
  std::string name = test.param.file;
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); },
      '_');
  return name;
});

TEST(StageWorldsFolder, HasNoWorldThatIsNotListed) {
  if (WorldsFolder().empty()) GTEST_SKIP() << "STAGE_SHARED_DIR is not set: no worlds to list";
  size_t found = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(WorldsFolder())) {
    if (entry.path().extension() != ".world") continue;
    found++;
    const std::string name =
        std::filesystem::relative(entry.path(), WorldsFolder()).generic_string();
    EXPECT_TRUE(std::any_of(std::begin(kWorlds), std::end(kWorlds), [&](const StageWorld& world) {
      return name == world.file;
    })) << name;
  }
  EXPECT_EQ(found, std::size(kWorlds));
}

/// The controllers of these worlds make the robots drive.
TEST(StageWorldsFolder, RobotsMove) {
  if (WorldsFolder().empty()) GTEST_SKIP() << "STAGE_SHARED_DIR is not set: no worlds to run";
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(WorldsFolder() + "simple.world"));
  const Pose start = Find(*world, "r0")->GetPose();
  Step(*world, 50);
  EXPECT_GT(Find(*world, "r0")->GetPose().Distance(start), 0.1);
}

}  // namespace
}  // namespace Stg
