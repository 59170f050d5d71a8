// SPDX-License-Identifier: GPL-2.0-or-later
//
// Invalid controllers, and actions of controllers in Init().

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "messages/report.hh"
#include "support/cli_testing.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

namespace fs = std::filesystem;

class ControllerCalls : public cli_testing::CliTest {
 protected:
  static std::string Unruly() {
    const char* build = std::getenv("STAGE_BINARY_DIR");
    return std::string(build ? build : ".") + "/tests/plugins/unruly.so";
  }
  static std::string WorldWith(const std::string& controller) {
    return "model( name \"before\" )\nposition( name \"r\" ctrl \"" + controller +
           "\" )\nmodel( name \"after\" )";
  }
  static LoadOutcome LoadWith(const std::string& argument) {
    return TryToLoad(WorldWith(Unruly() + " " + argument));
  }
  /// Loads a world with that file as controller; expects failure with an error line that has `why`.
  void ExpectBad(const std::string& file, const std::string& why) {
    const LoadOutcome outcome = TryToLoad(WorldWith(file));
    EXPECT_FALSE(outcome.loaded) << file;
    EXPECT_EQ(outcome.status, 255) << file;
    EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
    EXPECT_NE(outcome.errors.find(why), std::string::npos) << outcome.errors;
    EXPECT_NE(outcome.errors.find("t.world:2:25: controller "), std::string::npos)
        << outcome.errors;
  }
  /// Writes the first `size` bytes of a valid controller to a file with that name.
  std::string CopyOf(const std::string& name, uintmax_t size, std::string* bytes = nullptr) {
    std::string all = cli_testing::ReadFile(Unruly());
    if (bytes) *bytes = all;
    Write(name, all.substr(0, static_cast<size_t>(size)));
    return Path(name).string();
  }
};

TEST_F(ControllerCalls, ReportsExceptionOfInitInOneLine) {
  const std::pair<const char*, const char*> kWhat[] = {
      {"throw_number", "the number 42"},
      {"throw_text", "the text \"some text\""},
      {"throw_error", "an exception: out of order"},
      {"throw_own", "an exception of unknown type"}};
  for (const auto& [argument, what] : kWhat) {
    const LoadOutcome outcome = LoadWith(argument);
    EXPECT_FALSE(outcome.loaded);
    EXPECT_EQ(outcome.status, 255);
    EXPECT_EQ(outcome.models, 1u);
    EXPECT_EQ(outcome.errors, "t.world:2:25: Init() of the controller " +
                                  messages::Quoted(Unruly()) + " of the model \"r\" has thrown " +
                                  what + "\n");
  }
}

TEST_F(ControllerCalls, ReportsExceptionOfInitToCallingProgram) {
  const auto world = LoadText("model( name \"m\" )");
  Model* m = Find(*world, "m");
  m->LoadControllerModule((Unruly() + " throw_number").c_str());
  EXPECT_NE(ErrorsOf([&] { m->InitControllers(); }).find("has thrown the number 42"),
            std::string::npos);
  // The world is unchanged and can be used and deleted.
  EXPECT_NE(ErrorsOf([&] { m->InitControllers(); }), "");
  Step(*world);
}

TEST_F(ControllerCalls, InitEndsTheWorld) {
  for (const char* argument : {"unload", "unload_and_throw"}) {
    const LoadOutcome outcome = LoadWith(argument);
    EXPECT_FALSE(outcome.loaded);
    EXPECT_NE(outcome.status, 0);
    EXPECT_EQ(outcome.models, 1u);
    EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
  }
  World* world = EmptyWorld().release();
  std::istringstream text(WorldWith(Unruly() + " delete_world"));
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(world->Load(text, "t.world")); });
  EXPECT_EQ(errors, "stage: a callback deleted the world while it was being loaded\n");
  EXPECT_FALSE(World::Exists(world));
}

TEST_F(ControllerCalls, InitLoadsAnotherWorld) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(world.get(), WorldWith(Unruly() + " load"));
  EXPECT_TRUE(outcome.loaded);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.errors, "");
  EXPECT_EQ(outcome.models, 2u);
  EXPECT_NE(world->GetModel("another"), nullptr);
  Step(*world, 3);
}

TEST_F(ControllerCalls, InitReloadsSavesAndDeletes) {
  for (const char* argument : {"reload", "save", "delete_model"}) {
    const auto world = EmptyWorld();
    const LoadOutcome outcome = TryToLoad(world.get(), WorldWith(Unruly() + " " + argument));
    EXPECT_TRUE(outcome.loaded) << argument;
    EXPECT_EQ(outcome.models, argument == std::string("delete_model") ? 3u : 4u);
    Step(*world, 3);
  }
}

TEST_F(ControllerCalls, EndlessReloadingInInitIsLimited) {
  Write("self.world", WorldWith(Unruly() + " load_itself"));
  const auto result = Stage({"-g", "--duration", "1", Path("self.world")});
  EXPECT_EQ(result.status, 0);
  EXPECT_TRUE(cli_testing::Contains(result.err, "nested loads of worlds")) << result.err;
}

TEST_F(ControllerCalls, ProgramSurvivesAllControllers) {
  for (const char* argument : {"throw_number", "unload", "delete_world"}) {
    Write("t.world", WorldWith(Unruly() + " " + argument));
    const auto result = Stage({"-g", "--duration", "1", Path("t.world")});
    EXPECT_FALSE(result.hung);
    EXPECT_GT(result.status, 0) << argument;
    EXPECT_LT(result.status, 256) << argument;
    EXPECT_NE(result.status, 128 + SIGABRT) << argument;
    EXPECT_NE(result.status, 128 + SIGSEGV) << argument;
    EXPECT_EQ(cli_testing::CountOf(result.err, "\n"), 1u) << result.err;
  }
}

// ---- files that are no controllers --------------------------------------------------------------

TEST_F(ControllerCalls, RefusesPathsThatAreNotRegularFiles) {
  ASSERT_EQ(mkfifo(Path("pipe.so").c_str(), 0600), 0);
  ExpectBad(Path("pipe.so").string(), "found a pipe");
  fs::create_directory(Path("folder.so").string());
  ExpectBad(Path("folder.so").string(), "found a folder");
  fs::create_symlink("/dev/zero", Path("device.so").string());
  ExpectBad(Path("device.so").string(), "found a device");
  fs::create_symlink("loop.so", Path("loop.so").string());
  ExpectBad(Path("loop.so").string(), "symbolic links");
  ExpectBad(Path("missing.so").string(), "No such file");
}

TEST_F(ControllerCalls, RefusesNonFilesInAllSearchedFolders) {
  ASSERT_EQ(mkfifo(Path("pipe.so").c_str(), 0600), 0);
  for (const char* variable : {"STAGEPATH", "LD_LIBRARY_PATH"}) {
    setenv(variable, Path("").c_str(), 1);
    ExpectBad("pipe", "found a pipe");
    unsetenv(variable);
  }
}

TEST_F(ControllerCalls, RefusesUnreadableFile) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read everything";
  chmod(CopyOf("secret.so", ~uintmax_t{0}).c_str(), 0);
  ExpectBad(Path("secret.so").string(), "Permission denied");
}

TEST_F(ControllerCalls, RefusesFileTruncatedAnywhere) {
  std::string bytes;
  CopyOf("whole.so", ~uintmax_t{0}, &bytes);
  EXPECT_TRUE(TryToLoad(WorldWith(Path("whole.so").string())).loaded);
  ExpectBad(CopyOf("empty.so", 0), "is not a shared library");
  ExpectBad(CopyOf("header.so", 40), "is not a shared library");
  ExpectBad(CopyOf("segments.so", 100), "has been cut short");
  for (uintmax_t share = 1; share < 8; share++) {
    const std::string name = "cut" + std::to_string(share) + ".so";
    const LoadOutcome outcome = TryToLoad(WorldWith(CopyOf(name, bytes.size() * share / 8)));
    // The loader does not need data after the segments, such as debug symbols.
    if (outcome.loaded) continue;
    EXPECT_NE(outcome.errors.find("has been cut short"), std::string::npos) << outcome.errors;
  }
}

TEST_F(ControllerCalls, RefusesLibraryForOtherProcessor) {
  std::string bytes;
  CopyOf("good.so", 0, &bytes);
  constexpr size_t kClass = 4, kMachine = 18;
  for (const size_t place : {kClass, kMachine}) {
    std::string other = bytes;
    other[place] ^= 3;
    Write("other.so", other);
    ExpectBad(Path("other.so").string(), "for other processors");
  }
  Write("text.so", "this is not a library\n");
  ExpectBad(Path("text.so").string(), "is not a shared library");
}

}  // namespace
}  // namespace Stg
