// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_MODEL_TESTING_HH
#define STAGE_TESTS_MODEL_TESTING_HH

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"

/// Helpers for tests of models and worlds.
namespace Stg {

inline void InitLibrary() {
  static const bool done = [] {
    Init(nullptr, nullptr);
    return true;
  }();
  (void)done;
}

inline std::unique_ptr<World> EmptyWorld() {
  InitLibrary();
  return std::make_unique<World>();
}

/// Loads a world from a text, as if it were the file t.world in the current folder.
inline std::unique_ptr<World> LoadText(const std::string& text) {
  std::unique_ptr<World> world = EmptyWorld();
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

/// The outcome of loading a text.
struct LoadOutcome {
  bool loaded = false;
  int status = -1;
  std::string errors;  ///< everything written to standard error
  std::string output;  ///< everything written to standard output
  size_t models = 0;   ///< number of models afterwards, including the ground
};

inline LoadOutcome TryToLoad(World* world, const std::string& text,
                             const std::string& path = "t.world") {
  LoadOutcome outcome;
  std::istringstream content(text);
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  outcome.loaded = world->Load(content, path);
  outcome.output = testing::internal::GetCapturedStdout();
  outcome.errors = testing::internal::GetCapturedStderr();
  outcome.status = world->LoadStatus();
  outcome.models = world->GetAllModels().size();
  return outcome;
}

inline LoadOutcome TryToLoad(const std::string& text) {
  return TryToLoad(EmptyWorld().get(), text);
}

/// Return what `action` writes to standard error and standard output.
inline std::string ErrorsOf(const std::function<void()>& action) {
  testing::internal::CaptureStderr();
  action();
  return testing::internal::GetCapturedStderr();
}
inline std::string OutputOf(const std::function<void()>& action) {
  testing::internal::CaptureStdout();
  action();
  return testing::internal::GetCapturedStdout();
}

inline void Step(World& world, int count = 1) {
  for (int i = 0; i < count; i++) ASSERT_FALSE(world.Update());
}

/// The model with this type and name. Aborts the program if there is none.
template <class M = Model>
M* Find(const World& world, const std::string& name) {
  M* model = dynamic_cast<M*>(world.GetModel(name));
  if (!model) {
    ADD_FAILURE() << "no such model: " << name;
    abort();
  }
  return model;
}

/// The model with this type and name, after subscribing to it.
template <class M>
M* FindRunning(const World& world, const std::string& name) {
  M* model = Find<M>(world, name);
  model->Subscribe();
  return model;
}

inline void ExpectPose(const Pose& pose, double x, double y, double z, double a,
                       double tolerance = 1e-9) {
  EXPECT_NEAR(pose.x, x, tolerance);
  EXPECT_NEAR(pose.y, y, tolerance);
  EXPECT_NEAR(pose.z, z, tolerance);
  EXPECT_NEAR(pose.a, a, tolerance);
}

/// A log of the callbacks that were called.
struct Journal {
  std::vector<std::string> entries;
  std::string Text() const {
    std::string text;
    for (const std::string& entry : entries) text += (text.empty() ? "" : " ") + entry;
    return text;
  }
};

/// Side of a cell at the default resolution, metres.
inline constexpr double kCell = 0.02;

}  // namespace Stg

#endif
