// SPDX-License-Identifier: GPL-2.0-or-later

#include "threads/processors.hh"

#include <gtest/gtest.h>
#include <sched.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "support/emulated.hh"

namespace Stg::threads {
namespace {

namespace fs = std::filesystem;

/// A temporary folder that replaces /sys/fs/cgroup.
class Groups : public testing::Test {
 protected:
  void SetUp() override {
    root_ =
        fs::path(testing::TempDir()) /
        ("groups_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  void Write(const std::string& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text << "\n";
  }
  unsigned Granted(const std::string& groups) const {
    return CountGrantedProcessors(groups, root_.string());
  }

  fs::path root_;
};

TEST_F(Groups, WithoutLimitsGrantEverything) {
  EXPECT_EQ(Granted(""), 0u);
  EXPECT_EQ(Granted("0::/\n"), 0u);
  Write("cpu.max", "max 100000");
  Write("a/cpu.max", "max 100000");
  EXPECT_EQ(Granted("0::/a\n"), 0u);
  Write("cpu/cpu.cfs_quota_us", "-1");
  Write("cpu/cpu.cfs_period_us", "100000");
  EXPECT_EQ(Granted("1:cpu:/\n"), 0u);
}

TEST_F(Groups, VersionTwoCountsAllAncestors) {
  Write("a/b/cpu.max", "800000 100000");
  EXPECT_EQ(Granted("0::/a/b\n"), 8u);
  Write("a/cpu.max", "250000 100000");  // 2.5: a third thread would stall all
  EXPECT_EQ(Granted("0::/a/b\n"), 2u);
  EXPECT_EQ(Granted("0::/a/b/c/d\n"), 2u) << "missing groups have no limit";
  Write("cpu.max", "10000 100000");
  EXPECT_EQ(Granted("0::/a/b\n"), 1u) << "a tenth of a processor";
}

TEST_F(Groups, OfVersionOneAreThoseOfTheController) {
  Write("cpu,cpuacct/a/cpu.cfs_quota_us", "300000");
  Write("cpu,cpuacct/a/cpu.cfs_period_us", "100000");
  Write("cpuset/a/cpu.max", "100000 100000");
  EXPECT_EQ(Granted("5:cpuset:/a\n4:cpu,cpuacct:/a\n0::/\n"), 3u);
  EXPECT_EQ(Granted("5:cpuset:/a\n"), 0u);
}

TEST_F(Groups, InvalidGroupsAreIgnored) {
  Write("a/cpu.max", "many 100000");
  Write("b/cpu.max", "");
  Write("c/cpu.max", "100000 0");
  for (const char* text : {"0::/a", "0::/b", "0::/c", "0::", "0", "::", "x:y:z", "\n\n", "0::a/b"})
    EXPECT_EQ(Granted(text), 0u) << text;
}

TEST(Processors, AreThoseOfTheAffinityMask) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  EXPECT_GE(CountUsableProcessors(), 1u);
  EXPECT_LE(CountUsableProcessors(), static_cast<unsigned>(CPU_COUNT(&before)));
  if (test::IsEmulated()) GTEST_SKIP() << "emulators don't pass on affinity masks";
  cpu_set_t one;
  CPU_ZERO(&one);
  for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; cpu++)
    if (CPU_ISSET(cpu, &before)) CPU_SET(cpu, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  EXPECT_EQ(CountUsableProcessors(), 1u);
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
}

}  // namespace
}  // namespace Stg::threads
