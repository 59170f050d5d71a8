// SPDX-License-Identifier: GPL-2.0-or-later
//
// The shipped worlds: each loads without a warning and runs, and together they use every type of
// model.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "support/model_testing.hh"

namespace Stg {
namespace {

std::filesystem::path WorldsFolder() {
  const char* source = std::getenv("STAGE_SOURCE_DIR");
  return std::filesystem::path(source ? source : "..") / "worlds";
}

/// The shipped world files, sorted, so that the index in a failure identifies the file.
std::vector<std::string> WorldFiles() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(WorldsFolder()))
    if (entry.path().extension() == ".world") files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

/// Loads the world and returns its output on standard error; standard output is discarded.
std::string LoadErrors(World* world, const std::string& file) {
  testing::internal::CaptureStdout();
  bool loaded = false;
  std::string errors = ErrorsOf([&] { loaded = world->Load(file); });
  testing::internal::GetCapturedStdout();
  EXPECT_TRUE(loaded) << file << '\n' << errors;
  return errors;
}

TEST(Worlds, LoadWithoutWarningsAndRun) {
  const std::vector<std::string> files = WorldFiles();
  ASSERT_FALSE(files.empty()) << WorldsFolder();
  for (const std::string& file : files) {
    SCOPED_TRACE(file);
    const auto world = EmptyWorld();
    EXPECT_EQ(LoadErrors(world.get(), file), "");
    EXPECT_EQ(world->LoadStatus(), 0);
    EXPECT_EQ(ErrorsOf([&] { Step(*world, 20); }), "");
  }
}

TEST(Worlds, ShowEveryTypeOfModel) {
  std::set<std::string> shown;
  for (const std::string& file : WorldFiles()) {
    const auto world = EmptyWorld();
    LoadErrors(world.get(), file);
    for (const Model* model : world->GetAllModels()) shown.insert(model->GetModelType());
  }
  ASSERT_FALSE(Model::name_map.empty());
  for (const auto& [type, creator] : Model::name_map) EXPECT_EQ(shown.count(type), 1u) << type;
}

}  // namespace
}  // namespace Stg
