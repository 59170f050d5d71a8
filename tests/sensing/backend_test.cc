// SPDX-License-Identifier: GPL-2.0-or-later
//
// The backend interface: a backend that walks on the host (backends/host.cc) does not change
// results, and an incompatible backend is refused.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "sensing/prefilter.hh"
#include "stage.hh"
#include "support/random_world.hh"
#include "support/ray_scene.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"
#include "world/prefilter_loader.hh"

namespace {

using PrefilterPointer = std::unique_ptr<Stg::internal::sensing::Prefilter>;
using random_world::WorldText;
using ray_scene::RayScene;

std::string PathOf(const std::string& backend) {
  const char* build = std::getenv("STAGE_BINARY_DIR");
  return std::string(build ? build : ".") + "/tests/backends/" + backend + ".so";
}

PrefilterPointer MakeOnHost(const std::string& choice) {
  std::string message;
  PrefilterPointer prefilter = Stg::LoadPrefilter(PathOf("host"), choice, &message);
  EXPECT_TRUE(prefilter) << message;
  return prefilter;
}

bool IsOneLine(const std::string& text) {
  return !text.empty() && text.find('\n') == std::string::npos;
}

/// Expects that loading the backend returns nothing and gives a message that contains `reason`.
void ExpectRefused(const std::string& backend, const std::string& reason) {
  std::string message;
  EXPECT_EQ(Stg::LoadPrefilter(PathOf(backend), "", &message), nullptr);
  EXPECT_TRUE(IsOneLine(message)) << message;
  EXPECT_NE(message.find(reason), std::string::npos) << message;
  EXPECT_NE(message.find(backend), std::string::npos) << message;
  EXPECT_EQ(Stg::ListDevices(PathOf(backend)), message + "\n");
}

// ---- results ------------------------------------------------------------------------------------

TEST(BackendTest, ListsHitsLikeTheHostsWalk) {
  for (uint32_t per_ray = 1; per_ray <= 4; per_ray++) {
    SCOPED_TRACE(per_ray);
    const PrefilterPointer prefilter = MakeOnHost(std::to_string(per_ray));
    ASSERT_TRUE(prefilter);
    Stg::threads::WorkerPool workers(per_ray);
    RayScene scene(per_ray);
    for (int round = 0; round < 40 && !HasFailure(); round++) {
      const auto found = prefilter->Walk(scene.grid(), scene.tables(), scene.batch(), &workers);
      ASSERT_EQ(found.per_ray, per_ray);
      const std::vector<uint32_t> expected = ListsByWalk(scene, per_ray);
      EXPECT_EQ(FirstDifference(scene, expected, found), "");
      EXPECT_EQ(FirstWrongBody(scene, found), "");
      scene.Change();
      scene.MakeBatch();
    }
  }
}

/// Runs a world; `backend`: with the host's backend.
random_world::Outcome Drive(const WorldText& text, bool backend) {
  random_world::Outcome outcome;
  Stg::World world;
  std::istringstream content(text.text());
  EXPECT_TRUE(world.Load(content));
  if (backend) world.engine().tracer.SetPrefilter(MakeOnHost(""), true);
  random_world::Driver driver(text.seed(), text.resolution(), false);
  driver.Attach(&world);
  for (uint64_t step = 0; step < text.steps(); step++) {
    world.Update();
    outcome.hashes.push_back(world.StateHash());
  }
  outcome.device_steps = world.statistics().device_steps;
  outcome.resumed = world.statistics().trace.resumed;
  return outcome;
}

TEST(BackendTest, ChangesNothingInAnyWorld) {
  const random_world::Quiet quiet;
  uint64_t resumed = 0;
  for (uint64_t seed = 1; seed <= (kSanitized ? 5 : 40) && !HasFailure(); seed++) {
    SCOPED_TRACE(seed);
    const WorldText world(seed);
    const random_world::Outcome alone = Drive(world, false), found = Drive(world, true);
    EXPECT_EQ(alone.hashes, found.hashes);
    EXPECT_EQ(alone.device_steps, 0u);
    EXPECT_GT(found.device_steps, 0u);
    resumed += found.resumed;
  }
  EXPECT_GT(resumed, 0u);
}

// ---- the interface of the plug-in ---------------------------------------------------------------

TEST(BackendTest, IsRefusedIfItIsOfAnotherVersion) {
  ExpectRefused("other_version", "found version 4711 of stage_backend, expected version 6");
}

TEST(BackendTest, IsRefusedWithAnotherLayout) {
  ExpectRefused("other_layout", "found a plug-in of another build");
}

TEST(BackendTest, IsRefusedWithoutEntryPoint) { ExpectRefused("../plugins/mark", "stage_backend"); }

TEST(BackendTest, IsRefusedIfTheFileIsMissing) { ExpectRefused("nowhere", "No such file"); }

TEST(BackendTest, ListsDevices) {
  std::string message;
  EXPECT_EQ(Stg::LoadPrefilter(PathOf("host"), "gpu", &message), nullptr);
  const std::string list = Stg::ListDevices(PathOf("host"));
  EXPECT_NE(list.find("this process"), std::string::npos) << list;
  EXPECT_NE(message.find(list), std::string::npos) << message;
  EXPECT_NE(message.find("\"gpu\""), std::string::npos) << message;
}

TEST(BackendTest, DoesNotThrowAcrossTheInterface) {
  std::string message;
  EXPECT_EQ(Stg::LoadPrefilter(PathOf("host"), "broken", &message), nullptr);
  EXPECT_EQ(message, "this device is broken");
}

}  // namespace
