// SPDX-License-Identifier: GPL-2.0-or-later
//
// The program with little memory either runs or reports the lack of memory in one line.

#include <sys/resource.h>

#include <string>

#include "support/cli_testing.hh"
#include "support/crowd.hh"
#include "support/emulated.hh"
#include "support/sanitized.hh"

namespace {

using cli_testing::CliTest;
using cli_testing::Result;

class MemoryTest : public CliTest {
 protected:
  Result StageWith(rlim_t megabytes, const cli_testing::Strings& arguments) const {
    rlimit before{};
    getrlimit(RLIMIT_AS, &before);
    rlimit little = before;
    little.rlim_cur = megabytes << 20;
    setrlimit(RLIMIT_AS, &little);  // the program inherits it
    Result result = Stage(arguments);
    setrlimit(RLIMIT_AS, &before);
    return result;
  }
};

int RowOf(int i) { return i / 64; }

TEST_F(MemoryTest, ThreadsEndInOneLineToo) {
  if (Stg::test::IsEmulated()) GTEST_SKIP() << "the emulator ignores memory limits";
  if (kSanitized) GTEST_SKIP() << "sanitizers reserve more memory than a limit would leave";
  Write("crowd.world",
        "resolution 0.05\n" + crowd::Repeat(4000, [](int i) {
          return "position( alwayson 1 velocity [0.5 0 0 20] size [0.4 0.4 0.4] fiducial_return 1 "
                 "pose [" +
                 std::to_string(1.5 * (i % 64)) + " " + std::to_string(1.5 * RowOf(i)) +
                 " 0 0] ranger( alwayson 1 sensor( range [0 8] fov 180 samples 60 ) ) fiducial( "
                 "alwayson 1 range_max 3 ) )\n";
        }));
  int ran = 0, refused = 0;
  for (rlim_t megabytes = 40; megabytes <= 400; megabytes += megabytes < 120 ? 4 : 40) {
    const Result r =
        StageWith(megabytes, {"-g", "--threads", "4", "--duration", "0.3", "crowd.world"});
    SCOPED_TRACE(std::to_string(megabytes) + " MB: " + r.err);
    // glibc aborts if it can't allocate thread_local data; this can't be caught.
    if (r.err.find("Fatal glibc error: failed to register TLS destructor") != std::string::npos)
      continue;
    ASSERT_TRUE(r.status == 0 || r.status == 1) << r.status;
    (r.status == 0 ? ran : refused)++;
    if (r.status == 1) {
      EXPECT_TRUE(r.err.ends_with("stage: out of memory\n"));
      EXPECT_EQ(cli_testing::CountOf(r.err, "out of memory"), 1u);
    }
  }
  EXPECT_GT(ran, 0);
  EXPECT_GT(refused, 5);
}

}  // namespace
