// SPDX-License-Identifier: GPL-2.0-or-later
//
// Limits of memory for short world files, in which macros multiply large numbers of things.

#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A world with 100 instances of the macro, by two levels of macros.
std::string Hundred(const std::string& define) {
  std::string ten;
  for (int i = 0; i < 10; i++) ten += " inner( )";
  std::string hundred;
  for (int i = 0; i < 10; i++) hundred += "outer( )\n";
  return define + "\ndefine outer model(" + ten + " )\n" + hundred;
}

struct Greedy {
  const char* define;   ///< definition of the macro `inner`
  const char* place;    ///< line and column of the number in it
  const char* message;  ///< expected part of the message
};
const Greedy kGreedy[] = {
    {"define b block( points 100000 point[0] [1 1] )\n"
     "define inner model( b() b() b() b() b() )",
     "1:24", "100000 points"},
    {"define inner camera( resolution [3072 3072] )", "1:34", "9437184 pixels"},
    {"define s sensor( samples 1000000 )\ndefine inner ranger( s() )", "1:26", "1000000 samples"},
    {"define inner blobfinder( image [100000 1] )", "1:33", "100000 columns"},
    {"define inner bumper( bcount 10000 )", "1:29", "10000 bumpers"},
};

TEST(MemoryLimit, IsReportedInOneLine) {
  for (const Greedy& greedy : kGreedy) {
    // A limit below the default, which blobfinders and bumpers would hardly reach.
    const std::string limit = "memory_limit 100 ";
    std::string place = greedy.place;
    place = "1:" + std::to_string(std::stoi(place.substr(2)) + static_cast<int>(limit.size()));
    const LoadOutcome outcome = TryToLoad(limit + Hundred(greedy.define));
    EXPECT_FALSE(outcome.loaded) << greedy.define;
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.models, 1u);
    EXPECT_EQ(outcome.errors.rfind("t.world:" + place + ": found " + greedy.message, 0), 0u)
        << outcome.errors;
    EXPECT_NE(outcome.errors.find("expected at most 100 MB (memory_limit) in all\n"),
              std::string::npos)
        << outcome.errors;
  }
}

TEST(MemoryLimit, IsTwoGigabytesUnlessTheWorldHasAnother) {
  const std::string text =
      Hundred("define s sensor( samples 1000000 )\ndefine inner ranger( s() )");
  const LoadOutcome outcome = TryToLoad(text);
  EXPECT_FALSE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("expected at most 2000 MB (memory_limit) in all\n"),
            std::string::npos)
      << outcome.errors;
  // Without subscribers, loading does not allocate the samples, so the test does not need 2.4 GB.
  EXPECT_TRUE(TryToLoad("memory_limit 2400\n" + text).loaded);
  EXPECT_TRUE(TryToLoad("memory_limit 0\n" + text).loaded);
  EXPECT_FALSE(TryToLoad("memory_limit 2399\n" + text).loaded);
  for (const char* bad : {"-1", "0.5"})
    EXPECT_EQ(TryToLoad(std::string("memory_limit ") + bad).errors.rfind("t.world:1:14: ", 0), 0u);
}

TEST(MemoryLimit, CountsEachWorldAnew) {
  const auto world = EmptyWorld();
  for (int i = 0; i < 3; i++)
    EXPECT_TRUE(
        TryToLoad(world.get(), "memory_limit 30 ranger( sensor( samples 1000000 ) )").loaded);
}

}  // namespace
}  // namespace Stg
