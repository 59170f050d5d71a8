// SPDX-License-Identifier: GPL-2.0-or-later
//
// Files that are written completely or not at all.

#include "files/whole_file.hh"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "files/growing_file.hh"

namespace Stg::files {
namespace {

namespace fs = std::filesystem;

bool BeginsWithOurs(std::string_view beginning) { return beginning.starts_with("ours"); }

class WholeFileTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "whole-file-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Path(const std::string& name) const { return folder_ / name; }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(Path(name)) << text;
  }
  std::string Read(const std::string& name) const {
    std::ifstream in(Path(name));
    return std::string(std::istreambuf_iterator<char>(in), {});
  }
  size_t Count() const {
    return static_cast<size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(WholeFileTest, ReplacesOnlyOwnFiles) {
  EXPECT_EQ(TryReplaceFile(Path("a"), BeginsWithOurs), 0);
  EXPECT_EQ(Count(), 0u);
  EXPECT_EQ(ReplaceFile(Path("a"), "ours 1", BeginsWithOurs), 0);
  EXPECT_EQ(ReplaceFile(Path("a"), "ours 2", BeginsWithOurs), 0);
  EXPECT_EQ(Read("a"), "ours 2");
  Write("a", "mine");
  EXPECT_EQ(TryReplaceFile(Path("a"), BeginsWithOurs), EEXIST);
  EXPECT_EQ(ReplaceFile(Path("a"), "ours 3", BeginsWithOurs), EEXIST);
  EXPECT_EQ(Read("a"), "mine");
  EXPECT_EQ(ReplaceFile(Path("a"), "anything", AnyFile), 0);
  Write("a", "");
  EXPECT_EQ(ReplaceFile(Path("a"), "ours 4", BeginsWithOurs), 0);
  EXPECT_EQ(Count(), 1u);
}

TEST_F(WholeFileTest, ReplacesTheTargetOfALink) {
  Write("real", "ours");
  fs::permissions(Path("real"), fs::perms(0604));
  fs::create_symlink("real", Path("link"));
  EXPECT_EQ(ReplaceFile(Path("link"), "new", BeginsWithOurs), 0);
  EXPECT_EQ(Read("real"), "new");
  EXPECT_TRUE(fs::is_symlink(Path("link")));
  EXPECT_EQ(fs::status(Path("real")).permissions(), fs::perms(0604));
}

TEST_F(WholeFileTest, GrowingFileDoesNotFollowDanglingLinks) {
  fs::create_symlink(Path("nowhere"), Path("link"));
  GrowingFile file;
  ASSERT_EQ(file.Open(Path("link"), BeginsWithOurs), 0);
  EXPECT_EQ(file.Append("ours"), 0);
  EXPECT_EQ(file.Close(), 0);
  EXPECT_FALSE(fs::exists(Path("nowhere")));
  EXPECT_FALSE(fs::is_symlink(Path("link")));
  EXPECT_EQ(Read("link"), "ours");
  fs::create_symlink(Path("link"), Path("second"));
  ASSERT_EQ(file.Open(Path("second"), BeginsWithOurs), 0);
  EXPECT_EQ(Read("link"), "") << "our own file is emptied";
  EXPECT_TRUE(fs::is_symlink(Path("second")));
  EXPECT_EQ(file.Close(), 0);
  Write("link", "mine");
  EXPECT_EQ(file.Open(Path("second"), BeginsWithOurs), EEXIST);
  EXPECT_EQ(Read("link"), "mine");
  EXPECT_EQ(Count(), 2u);
}

TEST_F(WholeFileTest, CreatesOnlyMissingFiles) {
  EXPECT_EQ(MakeFile(Path("a"), "first"), 0);
  EXPECT_EQ(MakeFile(Path("a"), "second"), EEXIST);
  EXPECT_EQ(Read("a"), "first");
  fs::create_symlink("nowhere", Path("link"));
  EXPECT_EQ(MakeFile(Path("link"), "third"), EEXIST);
  EXPECT_FALSE(fs::exists(Path("nowhere")));
  EXPECT_EQ(Count(), 2u);
}

/// Several threads create files of the same names; each file is created exactly once.
TEST_F(WholeFileTest, ManyThreadsCanCreateFiles) {
  constexpr int kThreads = 4, kFiles = 200;
  std::atomic<int> made{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; t++)
    threads.emplace_back([&] {
      for (int i = 0; i < kFiles; i++) made += MakeFile(Path(std::to_string(i)), "x") == 0;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(made, kFiles);
  EXPECT_EQ(Count(), size_t{kFiles});
}

TEST_F(WholeFileTest, FailureLeavesNoFile) {
  Write("a", "ours");
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{5000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  const std::string much(100000, 'x');
  const int replaced = ReplaceFile(Path("a"), much, AnyFile), made = MakeFile(Path("b"), much);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(replaced, EFBIG);
  EXPECT_EQ(made, EFBIG);
  EXPECT_EQ(Read("a"), "ours");
  EXPECT_EQ(Count(), 1u);
}

TEST_F(WholeFileTest, ReportsErrors) {
  EXPECT_EQ(ReplaceFile(folder_, "x", AnyFile), EISDIR);
  EXPECT_EQ(ReplaceFile(Path("no/a"), "x", AnyFile), ENOENT);
  EXPECT_EQ(TryReplaceFile(Path("no/a"), AnyFile), ENOENT);
  Write("a", "");
  EXPECT_EQ(TryReplaceFile(Path("a/b"), AnyFile), ENOTDIR);
  EXPECT_NE(ReplaceFile("", "x", AnyFile), 0);
  EXPECT_EQ(ReplaceFile("/dev/full", "x", BeginsWithOurs), ENOSPC);
  EXPECT_EQ(ReplaceFile("/dev/null", "x", BeginsWithOurs), 0);
}

TEST_F(WholeFileTest, APipeIsWrittenTo) {
  ASSERT_EQ(mkfifo(Path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(TryReplaceFile(Path("pipe"), BeginsWithOurs), 0);  // does not wait for a reader
  std::string got;
  std::thread reader([&] { got = Read("pipe"); });
  EXPECT_EQ(ReplaceFile(Path("pipe"), "text", BeginsWithOurs), 0);
  reader.join();
  EXPECT_EQ(got, "text");
  EXPECT_TRUE(fs::is_fifo(Path("pipe")));
}

TEST_F(WholeFileTest, WritesToOpenDescriptors) {
  const int file = open(Path("a").c_str(), O_WRONLY | O_CREAT, 0600);
  ASSERT_GE(file, 0);
  const std::string name = "/dev/fd/" + std::to_string(file);
  EXPECT_EQ(ReplaceFile(name, "one ", BeginsWithOurs), 0);
  EXPECT_EQ(ReplaceFile(name, "two", BeginsWithOurs), 0);
  close(file);
  EXPECT_EQ(Read("a"), "one two");
}

}  // namespace
}  // namespace Stg::files
