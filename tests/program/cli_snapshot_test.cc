// SPDX-License-Identifier: GPL-2.0-or-later
//
// --save-snapshot and --from-snapshot: an interrupted run ends like an uninterrupted one.

#include <gtest/gtest.h>

#include <string>

#include "stage.hh"
#include "support/cli_testing.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace {

using namespace cli_testing;

class CliSnapshot : public CliTest {
 protected:
  std::string File(const std::string& name) { return Path(name).string(); }

  /// Output of --state-hash.
  std::string HashOf(Strings arguments) {
    arguments.insert(arguments.end(), {"-g", "--state-hash"});
    const Result result = Stage(arguments);
    EXPECT_EQ(result.status, 0) << result.err;
    const size_t at = result.out.find("state-hash ");
    return at == std::string::npos ? "" : result.out.substr(at, 27);
  }

  void ExpectOneLine(const Strings& arguments, int status, const std::string& part) {
    const Result result = Stage(arguments);
    EXPECT_EQ(result.status, status) << result.err;
    EXPECT_TRUE(Contains(result.err, part)) << result.err;
    EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
  }
};

TEST_F(CliSnapshot, EveryShippedWorldGoesOnFromAFile) {
  const std::string until = kSanitized ? "1" : "3", then = kSanitized ? "0.5" : "1.5";
  for (const std::string& world : ShippedWorlds()) {
    const std::string file = File("s.snapshot");
    const std::string whole = HashOf({"--seed", "7", "--duration", until, world});
    EXPECT_EQ(
        HashOf({"--seed", "7", "--duration", until, "--save-snapshot", file + "@" + then, world}),
        whole)
        << world;
    EXPECT_EQ(HashOf({"--duration", until, "--from-snapshot", file, world}), whole) << world;
    EXPECT_EQ(HashOf({"--duration", until, "--threads", "2", "--no-batch", "--from-snapshot", file,
                      world}),
              whole)
        << world;
    const std::string exact = HashOf({"--ray-model", "exact", "--duration", until, world});
    EXPECT_EQ(HashOf({"--ray-model", "exact", "--duration", until, "--save-snapshot",
                      file + "@" + then, world}),
              exact)
        << world;
    EXPECT_EQ(HashOf({"--duration", until, "--from-snapshot", file, world}), exact) << world;
  }
}

TEST_F(CliSnapshot, WithoutADurationTheRunEndsThere) {
  const std::string world = ShippedWorlds().front(), file = File("s.snapshot");
  const std::string there = HashOf({"--save-snapshot", file + "@2", world});
  EXPECT_EQ(there, HashOf({"--duration", "2", world}));
  EXPECT_EQ(there, HashOf({"--duration", "2", "--from-snapshot", file, world}));
}

TEST_F(CliSnapshot, BadOptionsAreRefused) {
  const std::string world = ShippedWorlds().front(), file = File("s.snapshot");
  for (const char* order : {"s", "s@", "@3", "s@-1", "s@x", "s@1e13", "s@nan"})
    ExpectOneLine({"-g", "--save-snapshot", order, world}, 2, "expected FILE@SECONDS");
  ExpectOneLine({"-g", "--duration", "1", "--save-snapshot", file + "@2", world}, 2, "--duration");
  ExpectOneLine({"-g", "--save-snapshot", file + "@2", world, world}, 2, "expected one");
  ExpectOneLine({"-g", "--save-snapshot", world + "@2", world}, 2, "is not a snapshot");
  ExpectOneLine({"-g", "--from-snapshot", file, world}, 1, "can't be read");
  ExpectOneLine({"-g", "--from-snapshot", world, world}, 1, "found something else");
}

TEST_F(CliSnapshot, DamagedFilesAreRefusedInOneLine) {
  const std::string world = ShippedWorlds().front(), file = File("s.snapshot");
  HashOf({"--save-snapshot", file + "@1", world});
  const std::string whole = ReadFile(file);
  ASSERT_GT(whole.size(), 1000u);
  Stg::test::RandomSource random(1);
  for (int i = 0; i < (kSanitized ? 3 : 20); i++) {
    std::string damaged = whole;
    if (random.OneIn(2))
      damaged.resize(static_cast<size_t>(random.Next() % whole.size()));
    else
      damaged[static_cast<size_t>(random.Next() % whole.size())] ^= static_cast<char>(1 << i % 8);
    Write("damaged", damaged);
    const Result result =
        Stage({"-g", "--duration", "2", "--from-snapshot", File("damaged"), world});
    EXPECT_EQ(result.status, 1) << result.err;
    EXPECT_EQ(CountOf(result.err, "\n"), 1u) << result.err;
  }
}

TEST_F(CliSnapshot, AnotherWorldsSnapshotIsRefused) {
  const std::vector<std::string> worlds = ShippedWorlds();
  const std::string file = File("s.snapshot");
  HashOf({"--save-snapshot", file + "@1", worlds[0]});
  for (size_t i = 1; i < worlds.size(); i++)
    ExpectOneLine({"-g", "--duration", "2", "--from-snapshot", file, worlds[i]}, 1,
                  "cannot restore the snapshot: found ");
}

}  // namespace
