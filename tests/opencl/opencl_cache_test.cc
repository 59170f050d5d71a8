// SPDX-License-Identifier: GPL-2.0-or-later
//
// PoCL's cache folder: not writable, with damaged files, or possibly created by another user. Also
// options that crash PoCL's compiler.

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

#include "support/cli_testing.hh"
#include "support/device.hh"

namespace {

using namespace cli_testing;

class CacheTest : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    if (const std::string none = device::WhyNone(); !none.empty()) GTEST_SKIP() << none;
    if (!Contains(Stage({"--opencl=list"}).out, kPocl)) GTEST_SKIP() << "PoCL is not installed";
    WriteRobots("w.world", "quit_time 1");
    plain_ = HashOf(Stage({"-g", "w.world", "--state-hash"}));
    ASSERT_NE(plain_, "");
  }

  static std::string HashOf(const Result& result) {
    const size_t at = result.out.find("state-hash ");
    return at == std::string::npos ? "" : result.out.substr(at, 27);
  }
  Result OnPocl(const Environment& environment) const {
    return Stage({"-g", "w.world", "--state-hash", "--opencl-always", "--opencl=auto"},
                 environment);
  }
  /// Expects one warning of one line with these words, and the results of a run without OpenCL.
  void ExpectGoesOn(const Environment& environment, const Strings& words) const {
    const Result r = OnPocl(environment);
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_EQ(HashOf(r), plain_);
    EXPECT_EQ(CountOf(r.err, "stage: warning: "), 1u) << r.err;
    for (const std::string& word : words)
      EXPECT_TRUE(Contains(r.err, word)) << word << " in " << r.err;
  }

  static constexpr const char* kPocl = "Portable Computing Language";
  std::string plain_;
};

TEST_F(CacheTest, UncreatableCacheIsNotReportedAsMissingDriver) {
  Write("file", "in the way");
  const std::string cache = Path("file/cache");
  ExpectGoesOn({{"POCL_CACHE_DIR", cache}},
               {kPocl, "can't write to its cache, " + cache, "set POCL_CACHE_DIR"});
  const Result list = Stage({"--opencl=list"}, {{"POCL_CACHE_DIR", cache}});
  EXPECT_TRUE(Contains(list.out, "can't write to its cache")) << list.out;
  EXPECT_FALSE(Contains(list.out, "is installed")) << list.out;
}

TEST_F(CacheTest, SurvivesDamagedCache) {
  const Environment environment = {{"POCL_CACHE_DIR", Path("cache")}};
  EXPECT_EQ(HashOf(OnPocl(environment)), plain_);
  int damaged = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(Path("cache"))) {
    if (!entry.is_regular_file()) continue;
    std::ofstream(entry.path()) << "this is neither a program nor a library";
    damaged++;
  }
  EXPECT_GT(damaged, 2);
  const Result r = OnPocl(environment);  // PoCL may or may not use them
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(HashOf(r), plain_);
  if (!r.err.empty()) {
    EXPECT_EQ(CountOf(r.err, "stage: warning: "), 1u) << r.err;
    EXPECT_TRUE(Contains(r.err, Path("cache").string())) << r.err;
  }
}

TEST_F(CacheTest, OptionsThatCrashTheCompiler) {
  const Result r = OnPocl({{"STAGE_CL_OPTIONS", "-D"}});
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_EQ(HashOf(r), plain_);
  EXPECT_EQ(CountOf(r.err, "stage: warning: "), 1u) << r.err;
}

// ---- without a home folder ----------------------------------------------------------------------

Environment Homeless(const fs::path& temporary, const std::string& session) {
  return {{"HOME", ""},
          {"XDG_CACHE_HOME", ""},
          {"POCL_CACHE_DIR", ""},
          {"TMPDIR", temporary},
          {"XDG_RUNTIME_DIR", session}};
}

/// Names of the files in a folder.
Strings NamesIn(const fs::path& folder) {
  Strings names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename());
  return names;
}

TEST_F(CacheTest, WithoutHomeUsesTheSessionFolder) {
  fs::create_directories(Path("session"));
  fs::create_directories(Path("tmp"));
  chmod(Path("session").c_str(), 0700);
  const Result r = OnPocl(Homeless(Path("tmp"), Path("session")));
  EXPECT_EQ(HashOf(r), plain_);
  EXPECT_EQ(r.err, "");
  EXPECT_EQ(NamesIn(Path("session")), Strings{"stage-pocl"});
  EXPECT_FALSE(NamesIn(Path("session/stage-pocl")).empty());
  struct stat status = {};
  ASSERT_EQ(stat(Path("session/stage-pocl").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
  EXPECT_TRUE(NamesIn(Path("tmp")).empty());
}

/// Number of files in PoCL's default folder, which is shared by all users.
ptrdiff_t FilesOfAnybody() {
  std::error_code missing;
  const fs::recursive_directory_iterator all("/tmp/pocl", missing);
  return missing ? 0 : std::distance(fs::begin(all), fs::end(all));
}

TEST_F(CacheTest, WithoutSessionUsesATemporaryFolder) {
  fs::create_directories(Path("tmp"));
  const ptrdiff_t files = FilesOfAnybody();
  Environment environment = Homeless(Path("tmp"), "");
  environment.emplace_back("STAGE_CL_OPTIONS", "-DNEVER_SEEN_BEFORE_" + std::to_string(getpid()));
  const Result r = OnPocl(environment);
  EXPECT_EQ(HashOf(r), plain_);
  EXPECT_EQ(r.err, "");
  EXPECT_TRUE(NamesIn(Path("tmp")).empty());
  EXPECT_EQ(FilesOfAnybody(), files);
}

TEST_F(CacheTest, RefusesCachesOfOtherUsers) {
  fs::create_directories(Path("tmp"));
  fs::create_directories(Path("session/stage-pocl"));
  chmod(Path("session").c_str(), 0700);
  chmod(Path("session/stage-pocl").c_str(), 0777);  // others could have written to it
  EXPECT_EQ(HashOf(OnPocl(Homeless(Path("tmp"), Path("session")))), plain_);
  EXPECT_TRUE(NamesIn(Path("session/stage-pocl")).empty());
  chmod(Path("session").c_str(), 0777);
  fs::remove(Path("session/stage-pocl"));
  EXPECT_EQ(HashOf(OnPocl(Homeless(Path("tmp"), Path("session")))), plain_);
  EXPECT_TRUE(NamesIn(Path("session")).empty());
  EXPECT_TRUE(NamesIn(Path("tmp")).empty());
}

}  // namespace
