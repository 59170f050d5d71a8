// SPDX-License-Identifier: GPL-2.0-or-later
//
// Several threads with separate worlds at the same time.

#include <functional>
#include <thread>

#include "support/model_testing.hh"

namespace Stg {
namespace {

std::string Plugin(const std::string& arguments) {
  const char* build = std::getenv("STAGE_BINARY_DIR");
  return std::string(build ? build : ".") + "/tests/plugins/unruly.so " + arguments;
}

void InFourThreads(const std::function<void(int)>& work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; i++) threads.emplace_back(work, i);
  for (std::thread& thread : threads) thread.join();
}

TEST(LoadingThreads, LoadWorldsWithControllersAtOnce) {
  InitLibrary();
  const std::string text =
      "position( name \"r\" alwayson 1 color \"random\" ranger( alwayson 1 sensor( ) ) ctrl \"" +
      Plugin("nothing") + "\" )\nmodel( pose [3 0 0 0] ctrl \"" + Plugin("reload") + "\" )";
  std::vector<uint64_t> hashes(4);
  OutputOf([&] {
    InFourThreads([&](int number) {
      for (int i = 0; i < 25; i++) {
        World world;
        std::istringstream content(text);
        if (!world.Load(content, "t.world")) return;
        Model* r = world.GetModel("r");
        if (world.FindModel(r->GetId()) != r || !World::Exists(&world)) return;
        for (int step = 0; step < 3; step++) world.Update();
        delete r;
        world.CreateModel(nullptr, "model");
        hashes[static_cast<size_t>(number)] = world.StateHash();
      }
    });
  });
  EXPECT_NE(hashes[0], 0u);
  for (const uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

// Runs in a new process that has not used the library before.
TEST(LoadingThreadsDeathTest, MakeTheFirstWorldsAtOnce) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const auto run = [] {
    InFourThreads([](int) {
      World world;
      std::istringstream content("position( )");
      if (!world.Load(content, "t.world")) std::abort();
    });
    std::exit(InitDone() ? 0 : 1);
  };
  EXPECT_EXIT(
      run(), testing::ExitedWithCode(0),
      "^stage: warning: a World was created before Init\\(\\); Init\\(\\) is called now\n$");
}

}  // namespace
}  // namespace Stg
