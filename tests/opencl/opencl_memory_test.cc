// SPDX-License-Identifier: GPL-2.0-or-later
//
// If host and device share memory, only data that the host writes is copied, and ranges are used
// only while mapped; a library between program and driver checks this (shim/mapping_opencl.cc).
// Also: devices without some features.

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "support/cli_testing.hh"
#include "support/device.hh"
#include "support/json.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace {

using namespace cli_testing;

std::string Shim(const std::string& name) {
  const char* const build = std::getenv("STAGE_BINARY_DIR");
  return std::string(build ? build : ".") + "/tests/" + name + "_opencl.so";
}

class MemoryTest : public CliTest {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers must be the first library";
    CliTest::SetUp();
    if (!fs::exists(Shim("mapping"))) GTEST_SKIP() << "the OpenCL headers are not installed";
    if (const std::string none = device::WhyNone(); !none.empty()) GTEST_SKIP() << none;
  }

  static std::string HashOf(const Result& result) {
    const size_t at = result.out.find("state-hash ");
    EXPECT_NE(at, std::string::npos) << result.err;
    return at == std::string::npos ? "" : result.out.substr(at, 27);
  }

  /// Starts a run in a new folder, which receives its statistics and log.
  std::unique_ptr<Process> Start(const std::string& name, Strings arguments,
                                 Environment environment) const {
    fs::create_directories(Path(name));
    for (const char* stale : {"log", "stats"}) fs::remove(Path(name) / stale);
    for (const char* more : {"-g", "--state-hash", "--stats", "stats"}) arguments.push_back(more);
    environment.emplace_back("STAGE_MAPPING_LOG", Path(name) / "log");
    return std::make_unique<Process>(Path(name), arguments, environment);
  }
  std::unique_ptr<Process> StartOnDevice(const std::string& name, Strings arguments,
                                         Environment environment) const {
    for (const char* more : {"--opencl-always", "--opencl"}) arguments.push_back(more);
    return Start(name, arguments, environment);
  }
  std::string Log(const std::string& name) const { return ReadFile(Path(name) / "log"); }
  nlohmann::json OpenClStats(const std::string& name) const {
    return Stats(name + "/stats")["opencl"];
  }
};

// ---- every world --------------------------------------------------------------------------------

class ShippedWorldsTest : public MemoryTest {
 protected:
  void Compare(const std::string& world) const {
    SCOPED_TRACE(world);
    const Strings arguments = {world, "--duration", "1", "--seed", "5"};
    const Environment watched = {{"LD_PRELOAD", Shim("mapping")}};
    const auto with = [](Environment environment, const std::string& memory) {
      environment.emplace_back("STAGE_CL_MEMORY", memory);
      return environment;
    };
    const auto host = Start("host", arguments, {});
    const auto shared = StartOnDevice("shared", arguments, with({}, "shared"));
    const std::string hash = HashOf(host->Finish());
    EXPECT_EQ(HashOf(shared->Finish()), hash);
    const auto own = StartOnDevice("own", arguments, with({}, "own"));
    const auto strict = StartOnDevice("strict", arguments, with(watched, "shared"));
    EXPECT_EQ(HashOf(own->Finish()), hash);
    EXPECT_EQ(HashOf(strict->Finish()), hash);
    EXPECT_FALSE(Contains(Log("strict"), "wrong")) << Log("strict");
    EXPECT_TRUE(Contains(Log("strict"), "\ntransferred 0\n")) << Log("strict");
    for (const std::string memory : {"shared", "own", "strict"}) {
      EXPECT_NE(OpenClStats(memory)["device"], "");
      EXPECT_EQ(OpenClStats(memory)["memory"], memory == "own" ? "own" : "shared");
    }
  }
};

TEST_F(ShippedWorldsTest, AreTheSameInEitherMemory) {
  const std::vector<std::string> worlds = ShippedWorlds();
  EXPECT_GT(worlds.size(), 10u);
  for (const std::string& world : worlds) Compare(world);
}

// ---- copies of memory ---------------------------------------------------------------------------

/// Bytes of a run: by its own statistics, and as seen by the shim.
struct Traffic {
  uint64_t sent, fetched, copied, mapped, seen_mapped, seen_transferred;

  Traffic operator-(const Traffic& o) const {
    return {sent - o.sent,     fetched - o.fetched,         copied - o.copied,
            mapped - o.mapped, seen_mapped - o.seen_mapped, seen_transferred - o.seen_transferred};
  }
};

class TrafficTest : public MemoryTest {
 protected:
  void SetUp() override {
    MemoryTest::SetUp();
    if (IsSkipped()) return;
    WriteRobots("w.world", "");
  }

  Traffic TrafficOf(const std::string& memory, const std::string& seconds) const {
    const Result result =
        StartOnDevice("run", {Path("w.world"), "--duration", seconds},
                      {{"LD_PRELOAD", Shim("mapping")}, {"STAGE_CL_MEMORY", memory}})
            ->Finish();
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(result.err, "");
    EXPECT_FALSE(Contains(Log("run"), "wrong")) << Log("run");
    const nlohmann::json stats = OpenClStats("run");
    std::istringstream log(Log("run"));
    std::map<std::string, uint64_t> seen;
    for (auto [name, bytes] = std::pair<std::string, uint64_t>(); log >> name >> bytes;)
      seen[name] = bytes;
    return {stats["bytes_sent"],   stats["bytes_fetched"], stats["bytes_copied"],
            stats["bytes_mapped"], seen["mapped"],         seen["transferred"]};
  }
  /// Traffic of nine seconds within a run, without its start.
  Traffic TrafficOf(const std::string& memory) const {
    return TrafficOf(memory, "10") - TrafficOf(memory, "1");
  }
};

TEST_F(TrafficTest, InSharedMemoryTheHostWritesAndNothingElseIsCopied) {
  EXPECT_EQ(TrafficOf("shared", "1").seen_transferred, 0u) << "when it begins";
  const Traffic traffic = TrafficOf("shared");
  EXPECT_GT(traffic.sent, 0u);
  EXPECT_EQ(traffic.fetched, 90u * 90 * 2 * 4) << "lists of 90 rays in 90 steps";
  EXPECT_EQ(traffic.copied, traffic.sent);
  EXPECT_EQ(traffic.mapped, traffic.seen_mapped);
  EXPECT_GE(traffic.mapped, traffic.sent + traffic.fetched);
}

TEST_F(TrafficTest, FromMemoryOfItsOwnAllIsCopied) {
  const Traffic traffic = TrafficOf("own");
  EXPECT_GT(traffic.sent, 0u);
  EXPECT_EQ(traffic.copied, 2 * traffic.sent + traffic.fetched);
  EXPECT_EQ(traffic.seen_transferred, traffic.sent + traffic.fetched);
  EXPECT_EQ(traffic.mapped, 0u) << "pinned memory stays mapped";
}

// ---- mistakes that the shim detects -------------------------------------------------------------

class MistakeTest : public TrafficTest {
 protected:
  Result With(const std::string& mistake) const {
    return StartOnDevice("run", {Path("w.world"), "--duration", "5"},
                         {{"LD_PRELOAD", Shim("mapping")},
                          {"STAGE_CL_MEMORY", "shared"},
                          {"STAGE_MAPPING_FAULT", mistake}})
        ->Finish();
  }
  void ExpectCrash(const std::string& mistake) const {
    EXPECT_EQ(With(mistake).status, 128 + SIGSEGV) << mistake;
  }
  void ExpectLogged(const std::string& mistake, const std::string& line) const {
    const Result result = With(mistake);
    EXPECT_EQ(CountOf(Log("run"), "wrong: " + line), 1u) << mistake << "\n" << Log("run");
    EXPECT_EQ(CountOf(result.err, "stage: warning: "), 1u) << mistake << "\n" << result.err;
  }
};

// Faults in consecutive calls in the middle of the run, so that all mapped ranges of a step are
// covered.
TEST_F(MistakeTest, TouchingWhatIsNotMapped) {
  for (const char* number : {"40", "41", "42"}) ExpectCrash(std::string("early:") + number);
  ExpectCrash("unseen:40");
}

TEST_F(MistakeTest, MappingTwice) {
  for (const char* number : {"40", "41", "42"})
    ExpectLogged(std::string("again:") + number, "mapped where it is mapped for writing already");
}

TEST_F(MistakeTest, UnmappingNotAtAllOrTwice) {
  for (const char* number : {"40", "41", "42"}) {
    ExpectLogged(std::string("kept:") + number, "a kernel with a mapped argument");
    ExpectLogged(std::string("twice:") + number, "unmapped without having been mapped");
  }
}

// ---- devices that lack something ----------------------------------------------------------------

class DeviceTest : public MemoryTest {
 protected:
  void SetUp() override {
    MemoryTest::SetUp();
    if (IsSkipped()) return;
    WriteRobots("w.world", "quit_time 1");
    plain_ = HashOf(Stage({"-g", "w.world", "--state-hash"}));
  }
  Result With(Environment device, const std::string& option) const {
    device.emplace_back("LD_PRELOAD", Shim("device"));
    return Stage({"-g", "w.world", "--state-hash", "--opencl-always", option}, device);
  }
  void ExpectRefused(const Environment& device, const std::string& reason) const {
    const Result goes_on = With(device, "--opencl");
    EXPECT_EQ(goes_on.status, 0);
    EXPECT_EQ(HashOf(goes_on), plain_);
    EXPECT_EQ(CountOf(goes_on.err, "stage: warning: "), 1u) << goes_on.err;
    EXPECT_TRUE(Contains(goes_on.err, reason)) << goes_on.err;
    const Result ends = With(device, "--opencl=auto:0");
    EXPECT_NE(ends.status, 0);
    EXPECT_TRUE(Contains(ends.err, reason)) << ends.err;
  }

  std::string plain_;
};

TEST_F(DeviceTest, EmbeddedProfileIsSupported) {
  const Environment device = {{"STAGE_DEVICE_PROFILE", "EMBEDDED_PROFILE"},
                              {"STAGE_DEVICE_EXTENSIONS", "cl_khr_icd cles_khr_int64"}};
  const Result result = With(device, "--opencl=auto:0");
  EXPECT_EQ(HashOf(result), plain_);
  EXPECT_EQ(result.err, "");
  EXPECT_TRUE(Contains(With(device, "--opencl=list").out, ", embedded profile, "));
  EXPECT_FALSE(Contains(With({}, "--opencl=list").out, "embedded"));
}

TEST_F(DeviceTest, AcceleratorsAreChosenByTheirKind) {
  const Environment device = {{"STAGE_DEVICE_TYPE", "8"}};
  EXPECT_TRUE(Contains(With(device, "--opencl=list").out, "  accelerator: "));
  const Result result = With(device, "--opencl=accelerator");
  EXPECT_EQ(HashOf(result), plain_) << result.err;
  EXPECT_NE(With(device, "--opencl=cpu").status, 0);
}

TEST_F(DeviceTest, RefusesDevicesWithoutLongIntegers) {
  ExpectRefused({{"STAGE_DEVICE_PROFILE", "EMBEDDED_PROFILE"}, {"STAGE_DEVICE_EXTENSIONS", ""}},
                "embedded profile without 64-bit integers (cles_khr_int64)");
}

TEST_F(DeviceTest, RefusesDevicesWithoutCompiler) {
  ExpectRefused({{"STAGE_DEVICE_COMPILER", "0"}}, "has no compiler for the kernels");
}

TEST_F(DeviceTest, RefusesDevicesWithUnalignedBuffers) {
  ExpectRefused({{"STAGE_DEVICE_ALIGNMENT", "64"}}, "aligned to 64 bits, the kernels need 128");
}

}  // namespace
