// SPDX-License-Identifier: GPL-2.0-or-later
//
// An exception during loading or stepping leaves World::Load() or World::Update(), with any number
// of threads; afterwards the world can be loaded again and deleted.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <new>
#include <sstream>
#include <string>

#include "models/exception_origin.hh"
#include "support/crowd.hh"
#include "support/model_testing.hh"

namespace {

/// Number of allocations, on all threads, until one fails; negative: none fails.
std::atomic<int64_t> allocations_left{-1};
/// If true, all allocations after the first failing one fail, too.
std::atomic<bool> nothing_left_after{false};

bool FallsToFail() {
  if (allocations_left.load(std::memory_order_relaxed) < 0) return false;
  if (nothing_left_after.load(std::memory_order_relaxed) && allocations_left.load() == 0)
    return true;
  return allocations_left.fetch_sub(1) == 0;
}

}  // namespace

// Not inlined, because GCC would warn of the pair new and free().
__attribute__((noinline)) void* operator new(std::size_t size) {
  void* memory = FallsToFail() ? nullptr : std::malloc(size > 0 ? size : 1);
  if (!memory) throw std::bad_alloc();
  return memory;
}
// The nothrow version is replaced, too, because that of the sanitizers does not call the one above.
__attribute__((noinline)) void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return FallsToFail() ? nullptr : std::malloc(size > 0 ? size : 1);
}
__attribute__((noinline)) void operator delete(void* memory) noexcept { std::free(memory); }
__attribute__((noinline)) void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace {

int RowOf(int i) { return i / 6; }

std::string SensorsOfAllTypes(int robots) {
  return "resolution 0.05\n" + crowd::Repeat(robots, [](int i) {
           return "position( size [0.4 0.3 0.3] fiducial_return 1 pose [" +
                  std::to_string(0.8 * (i % 6)) + " " + std::to_string(0.8 * RowOf(i)) + " 0 " +
                  std::to_string(i * 40 % 360) +
                  "] ranger( sensor( range [0 3] fov 180 samples 7 noise [0 0.1 0.5] ) )"
                  " ranger( sensor( samples 3 ) sensor( samples 2 ray_model \"exact\" ) )"
                  " fiducial( range_max 3 ) blobfinder( image [20 10] range 3 )"
                  " bumper( bcount 1 bpose[0] [0.2 0 0 0] blength 0.2 )"
                  " gripper( size [0.2 0.3 0.2] pose [0.25 0 -0.2 0] autosnatch 1 )"
                  " wifi( model \"raytrace\" power 20 sensitivity -40 )"
                  " camera( resolution [8 6] range [0.2 6] )"
                  " actuator( type \"linear\" axis [1 0 0] size [0.1 0.1 0.1] ) )\n";
         });
}

std::unique_ptr<Stg::World> LoadWith(int threads, const std::string& text) {
  Stg::InitLibrary();
  Stg::World::run_options.threads = threads;
  Stg::World::run_options.share_from = 1;
  auto world = Stg::LoadText(text);
  Stg::World::run_options = Stg::RunOptions();
  world->ForEachDescendant(
      [](Stg::Model* model, void*) {
        model->Subscribe();
        if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) robot->SetSpeed(0.7, 0, 0.4);
        return 0;
      },
      nullptr);
  return world;
}

/// Deletes a robot while the rays of other robots are in the batch.
int DeleteLastRobot(Stg::Model* model, void*) {
  Stg::Model* last = model->GetWorld()->GetChildren().back();
  if (last != model) delete last;
  return 0;
}

/// Makes a step in which the n-th allocation fails. Returns false if there were fewer.
bool FailsAt(int64_t n, int threads, const std::string& text) {
  const auto world = LoadWith(threads, text);
  Stg::Model* fifth = world->GetChildren()[5];
  fifth->AddCallback(Stg::Model::CB_VELOCITY, DeleteLastRobot, nullptr);
  bool failed = false;
  allocations_left = n;
  for (int step = 0; step < 4; step++) {
    try {
      world->Update();
    } catch (const std::bad_alloc&) {
      failed = true;
    }
  }
  allocations_left = -1;
  world->Update();  // the world must still be usable
  return failed;
}

TEST(OutOfMemory, LeavesUpdateWithAnyNumberOfThreads) {
  const std::string text = SensorsOfAllTypes(12);
  for (const int threads : {1, 2, 4}) {
    int failures = 0;
    int64_t n = 0;
    // Fail each of the first allocations, then an increasingly sparse selection.
    for (int in_vain = 0; in_vain < 3; n += 1 + n / 60) {
      if (FailsAt(n, threads, text)) {
        failures++;
        in_vain = 0;
      } else {
        in_vain++;
      }
      if (n > 200000) break;
    }
    EXPECT_GT(failures, 50) << threads << " threads";
  }
}

// ---- loading ------------------------------------------------------------------------------------

/// A world with all types of devices, and with features that only world files have.
std::string AllThatIsLoaded() {
  return SensorsOfAllTypes(2) +
         "define puck model( size [0.1 0.1 0.1] block( points 3 point[0] [0 0] point[1] [1 0] "
         "point[2] [0 1] z [0 1] ) )\n"
         "puck( joules 10 watts 1 mass 2 )\n"
         "model( pose [3 3 0 0] block( points 4 point[0] [0 0] point[1] [1 0] point[2] [1 1] "
         "point[3] [0 1] ) boundary 1 )\n"
         "lightindicator( name \"lamp\" )\n";
}

using Load = std::function<bool(Stg::World*)>;

/// Loads a world while the n-th allocation fails. Returns false if there were fewer.
bool LoadFailsAt(int64_t n, const Load& load) {
  Stg::World world;
  bool failed = false;
  allocations_left = n;
  try {
    load(&world);
  } catch (const std::bad_alloc&) {
    failed = true;
  }
  allocations_left = -1;
  EXPECT_TRUE(load(&world)) << n;
  world.Update();
  return failed;
}

/// Fails each of the first allocations, then an increasingly sparse selection; returns their
/// number.
int CountLoadFailures(const Load& load, int64_t ever_fewer) {
  int failures = 0;
  int64_t n = 0;
  for (int in_vain = 0; in_vain < 3; n += 1 + n / ever_fewer) {
    const bool failed = LoadFailsAt(n, load);
    failures += failed;
    in_vain = failed ? 0 : in_vain + 1;
  }
  return failures;
}

TEST(OutOfMemory, LeavesLoadAndTheWorldCanBeReloaded) {
  Stg::InitLibrary();
  const std::string text = AllThatIsLoaded();
  for (const bool nothing_left : {false, true}) {
    nothing_left_after = nothing_left;
    const auto load = [&](Stg::World* world) {
      std::istringstream content(text);
      return world->Load(content, "t.world");
    };
    EXPECT_GT(CountLoadFailures(load, 100000), 500);
  }
  nothing_left_after = false;
}

TEST(OutOfMemory, LeavesLoadForEachShippedWorld) {
  Stg::InitLibrary();
  nothing_left_after = true;
  int worlds = 0;
  const char* source = std::getenv("STAGE_SOURCE_DIR");
  ASSERT_TRUE(source);
  for (const auto& file : std::filesystem::directory_iterator(std::string(source) + "/worlds")) {
    if (file.path().extension() != ".world") continue;
    SCOPED_TRACE(file.path().string());
    worlds++;
    EXPECT_GT(
        CountLoadFailures([&](Stg::World* world) { return world->Load(file.path().string()); }, 5),
        20);
  }
  EXPECT_GE(worlds, 5);
  nothing_left_after = false;
}

// ---- exceptions of callbacks --------------------------------------------------------------------

struct Plan {
  const Stg::Model* thrower;
};

int ThrowSomething(Stg::Model* model, void* plan) {
  if (model->GetId() >= static_cast<Plan*>(plan)->thrower->GetId()) throw 42;
  return 0;
}

/// The error names the first model that throws, and the world can go on afterwards.
TEST(CallbacksThatThrow, AreTheSameWithAnyNumberOfThreads) {
  const std::string text = crowd::Repeat(40, [](int i) {
    return "position( name \"r" + std::to_string(i) + "\" pose [" + std::to_string(i) +
           " 0 0 0] )\n";
  });
  for (const int threads : {1, 2, 4}) {
    const auto world = LoadWith(threads, text);
    Plan plan{world->GetModel("r17")};
    for (Stg::Model* robot : world->GetChildren())
      if (robot != world->GetGround())
        robot->AddParallelCallback(Stg::Model::CB_UPDATE, ThrowSomething, &plan);
    for (int step = 0; step < 3; step++) {
      EXPECT_THROW(world->Update(), int);
      EXPECT_EQ(std::string(Stg::ExceptionOrigin()).find("a callback of model \"r17\""), 0u)
          << Stg::ExceptionOrigin();
    }
    for (Stg::Model* robot : world->GetChildren())
      robot->RemoveCallback(Stg::Model::CB_UPDATE, ThrowSomething);
    EXPECT_FALSE(world->Update());
    EXPECT_STREQ(Stg::ExceptionOrigin(), "");
  }
}

TEST(CallbacksThatThrow, DuringUpdatesLoseNoUpdates) {
  for (const int threads : {1, 4}) {
    const auto world = LoadWith(threads, crowd::Repeat(20, [](int i) {
                                  return "position( name \"r" + std::to_string(i) + "\" pose [0 " +
                                         std::to_string(i) +
                                         " 0 0] ranger( sensor( samples 3 ) ) )\n";
                                }));
    world->Enqueue(
        0, 0, world->GetModel("r3"), [](Stg::Model*, void*) -> int { throw 42; }, nullptr);
    EXPECT_THROW(world->Update(), int);
    for (int step = 0; step < 3; step++) EXPECT_FALSE(world->Update());
    const auto* ranger =
        static_cast<const Stg::ModelRanger*>(world->GetModel("r19")->GetChildren()[0]);
    EXPECT_EQ(ranger->GetSensors()[0].ranges.size(), 3u);
  }
}

}  // namespace
