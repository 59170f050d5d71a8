// SPDX-License-Identifier: GPL-2.0-or-later
//
// OpenCL that is missing, broken, or fails during the run. A run with the best device continues
// without it, with one warning and the same result; a run with a specific device fails with the
// reason. No behaviour of a driver may crash the program.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "models/messages.hh"
#include "sensing/prefilter.hh"
#include "stage.hh"
#include "support/cli_testing.hh"
#include "support/device.hh"
#include "support/hit_lists.hh"
#include "world/engine.hh"
#include "world/prefilter_loader.hh"

namespace {

using namespace cli_testing;

bool DeviceFound() { return device::WhyNone().empty(); }

class FaultsTest : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    WriteRobots("w.world", "quit_time 1");
    plain_ = HashOf(Stage({"-g", "w.world", "--state-hash"}));
    ASSERT_NE(plain_, "");
  }

  template <typename F>
  void ForEachCrowd(F f);

  static std::string HashOf(const Result& result) {
    const size_t at = result.out.find("state-hash ");
    return at == std::string::npos ? "" : result.out.substr(at, 27);
  }

  Result WithDevice(const std::string& option, const Environment& environment) const {
    return Stage({"-g", "w.world", "--state-hash", "--opencl-always", option}, environment);
  }
  /// Expects one warning on standard error, and the result of a run without OpenCL.
  void ExpectGoesOn(const Environment& environment, const std::string& reason) const {
    const Result r = WithDevice("--opencl", environment);
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_EQ(HashOf(r), plain_);
    EXPECT_EQ(CountOf(r.err, "stage: "), 1u) << r.err;  // drivers may print other lines
    EXPECT_EQ(CountOf(r.err, "stage: warning: "), 1u) << r.err;
    EXPECT_TRUE(Contains(r.err, "without OpenCL")) << r.err;
    EXPECT_TRUE(Contains(r.err, reason)) << r.err;
  }
  /// Expects an error message with the reason, and no run.
  void ExpectFails(const std::string& option, const Environment& environment,
                   const std::string& reason) const {
    const Result r = WithDevice(option, environment);
    EXPECT_NE(r.status, 0);
    EXPECT_LT(r.status, 128) << "ended by a signal";
    EXPECT_EQ(HashOf(r), "");
    EXPECT_TRUE(Contains(r.err, reason)) << r.err;
    EXPECT_EQ(CountOf(r.err, "stage: "), 1u) << r.err;
  }

  /// Environment with a driver folder whose only driver is this library.
  Environment Driver(const std::string& library) const {
    Write("vendors/broken.icd", library + "\n");
    return {{"OCL_ICD_VENDORS", Path("vendors").string() + "/"},
            {"OPENCL_VENDOR_PATH", Path("vendors")}};
  }
  /// Compiles a C library. Returns false if there is no compiler.
  bool Compile(const std::string& name, const std::string& text) const {
    Write(name + ".c", text);
    const std::string base = Path(name).string();
    const std::string command =
        "cc -shared -fPIC -o '" + base + ".so' '" + base + ".c' 2>/dev/null";
    return std::system(command.c_str()) == 0;
  }

  std::string plain_;
};

bool PluginIsBuilt() {
  std::string message;
  Stg::LoadPrefilter(Stg::kOpenClPlugin, "no such device", &message);
  return !Contains(message, "can't be loaded");
}

#define SKIP_WITHOUT_PLUGIN() \
  if (!PluginIsBuilt()) GTEST_SKIP() << "the OpenCL plug-in is not built"

// ---- drivers ------------------------------------------------------------------------------------

const Environment kNoDrivers = {{"OCL_ICD_VENDORS", "/nonexistent"},
                                {"OPENCL_VENDOR_PATH", "/nonexistent"}};

TEST_F(FaultsTest, NoDriver) {
  SKIP_WITHOUT_PLUGIN();
  ExpectGoesOn(kNoDrivers, "no OpenCL driver is");
  EXPECT_EQ(HashOf(WithDevice("--opencl=auto", kNoDrivers)), plain_);
  for (const char* choice : {"--opencl=cpu", "--opencl=gpu", "--opencl=auto:0", "--opencl=pocl"})
    ExpectFails(choice, kNoDrivers, "no OpenCL device");
  const Result r = Stage({"--opencl=list"}, kNoDrivers);
  EXPECT_EQ(r.status, 0);
  EXPECT_TRUE(Contains(r.out, "no OpenCL device")) << r.out;
}

TEST_F(FaultsTest, DriverWithoutItsLibrary) {
  SKIP_WITHOUT_PLUGIN();
  ExpectGoesOn(Driver("/nonexistent/libnone.so"), "broken.icd names can't be used");
  ExpectFails("--opencl=cpu", Driver("/nonexistent/libnone.so"), "no OpenCL device");
}

TEST_F(FaultsTest, DriverThatIsNoLibrary) {
  SKIP_WITHOUT_PLUGIN();
  Write("text.so", "this is not a library\n");
  ExpectGoesOn(Driver(Path("text.so")), "no OpenCL device");
}

TEST_F(FaultsTest, DriverThatAbortsWhenItIsLoaded) {
  SKIP_WITHOUT_PLUGIN();
  if (!Compile("abort",
               "#include <stdlib.h>\n"
               "__attribute__((constructor)) static void start(void) { abort(); }\n"))
    GTEST_SKIP() << "no C compiler";
  ExpectGoesOn(Driver(Path("abort.so")), "crashes");
  ExpectFails("--opencl=cpu", Driver(Path("abort.so")), "crashes");
}

TEST_F(FaultsTest, DriverThatCrashesWhenItIsAsked) {
  SKIP_WITHOUT_PLUGIN();
  if (!Compile("crash",
               "#include <string.h>\n"
               "int clIcdGetPlatformIDsKHR(unsigned n, void **p, unsigned *count) {\n"
               "  *(volatile int *)8 = 1; return 0; }\n"
               "void *clGetExtensionFunctionAddress(const char *name) {\n"
               "  return strcmp(name, \"clIcdGetPlatformIDsKHR\") ? 0 :\n"
               "         (void *)clIcdGetPlatformIDsKHR; }\n"
               "int clGetPlatformInfo(void *a, unsigned b, unsigned long c, void *d,\n"
               "                      unsigned long *e) { return -30; }\n"))
    GTEST_SKIP() << "no C compiler";
  ExpectGoesOn(Driver(Path("crash.so")), "crashes in clGetPlatformIDs (Segmentation fault)");
}

TEST_F(FaultsTest, DriverThatEndsTheProcess) {
  SKIP_WITHOUT_PLUGIN();
  if (!Compile("leave",
               "#include <stdlib.h>\n"
               "__attribute__((constructor)) static void start(void) { _Exit(3); }\n"))
    GTEST_SKIP() << "no C compiler";
  ExpectGoesOn(Driver(Path("leave.so")), "ends the process in clGetPlatformIDs");
}

TEST_F(FaultsTest, WithoutTheOptionNoDriverIsTouched) {
  if (!Compile("abort",
               "#include <stdlib.h>\n"
               "__attribute__((constructor)) static void start(void) { abort(); }\n"))
    GTEST_SKIP() << "no C compiler";
  const Result r = Stage({"-g", "w.world", "--state-hash"}, Driver(Path("abort.so")));
  EXPECT_EQ(HashOf(r), plain_);
  EXPECT_EQ(r.err, "");
}

// ---- kernels ------------------------------------------------------------------------------------

TEST_F(FaultsTest, KernelsThatDoNotCompile) {
  if (!DeviceFound()) GTEST_SKIP() << "no OpenCL device";
  const Environment environment = {{"STAGE_CL_OPTIONS", "-Dray_begin="}};
  ExpectGoesOn(environment, "rejects the kernels");
  ExpectFails("--opencl=auto:0", environment, "rejects the kernels");
  ExpectGoesOn({{"STAGE_CL_OPTIONS", "--no-such-option"}}, "");
}

TEST_F(FaultsTest, WrongEnvironment) {
  if (!DeviceFound()) GTEST_SKIP() << "no OpenCL device";
  for (const char* hits : {"0", "17", "-1", "3x", "many", "99999999999"}) {
    const std::string expected = std::string("STAGE_CL_HITS is \"") + hits + "\", expected 1 to 16";
    ExpectGoesOn({{"STAGE_CL_HITS", hits}}, expected);
    ExpectFails("--opencl=auto:0", {{"STAGE_CL_HITS", hits}}, expected);
  }
  for (const char* seconds : {"-1", "1.5", "1s", "100001"})
    ExpectGoesOn({{"STAGE_CL_TIMEOUT", seconds}},
                 std::string("STAGE_CL_TIMEOUT is \"") + seconds + "\", expected 0 to 100000");
  EXPECT_EQ(HashOf(WithDevice("--opencl=auto:0", {{"STAGE_CL_TIMEOUT", "0"}})), plain_);
  const Environment memory = {{"STAGE_CL_MEMORY", "both"}};
  ExpectGoesOn(memory, "STAGE_CL_MEMORY is \"both\", expected own or shared");
  ExpectFails("--opencl=auto:0", memory, "expected own or shared");
  for (const char* choice : {"own", "shared", ""})
    EXPECT_EQ(HashOf(WithDevice("--opencl=auto:0", {{"STAGE_CL_MEMORY", choice}})), plain_);
}

TEST_F(FaultsTest, WorksWithoutFaults) {
  // Without faults, the warnings that other tests expect must not appear.
  if (!DeviceFound()) GTEST_SKIP() << "no OpenCL device";
  const Result r = WithDevice("--opencl", {});
  EXPECT_EQ(HashOf(r), plain_);
  EXPECT_EQ(CountOf(r.err, "stage: "), 0u) << r.err;
  EXPECT_EQ(HashOf(WithDevice("--opencl=auto:0", {{"STAGE_CL_HITS", "3"}})), plain_);
}

// ---- the plug-in --------------------------------------------------------------------------------

/// A copy of the program, its library and other plug-ins, without the OpenCL plug-in.
class MissingPluginTest : public FaultsTest {
 protected:
  void SetUp() override {
    FaultsTest::SetUp();
    build_ = std::getenv("STAGE_BINARY_DIR") ? std::getenv("STAGE_BINARY_DIR") : ".";
    const auto options = fs::copy_options::recursive | fs::copy_options::copy_symlinks;
    fs::create_directories(Path("copy"));
    fs::copy(fs::path(build_) / "bin", Path("copy/bin"), options);
    fs::copy(fs::path(build_) / "lib", Path("copy/lib"), options);
    for (const fs::directory_entry& entry : fs::directory_iterator(Path("copy/lib")))
      if (entry.is_directory()) fs::remove(plugin_ = entry.path() / "stage_cl.so");
    setenv("STAGE_BINARY_DIR", Path("copy").c_str(), 1);
  }
  void TearDown() override {
    setenv("STAGE_BINARY_DIR", build_.c_str(), 1);
    FaultsTest::TearDown();
  }

  std::string build_;
  fs::path plugin_;
};

TEST_F(MissingPluginTest, IsReportedOnce) {
  ExpectGoesOn({}, "plug-in");
  ExpectFails("--opencl=cpu", {}, "plug-in");
  EXPECT_TRUE(Contains(Stage({"--opencl=list"}).out, "plug-in"));
}

TEST_F(MissingPluginTest, BrokenPluginIsReportedOnce) {
  ASSERT_FALSE(plugin_.empty());
  std::ofstream(plugin_) << "not a library";
  ExpectGoesOn({}, "plug-in");
  fs::remove(plugin_);
  if (!Compile("empty", "int nothing;\n")) GTEST_SKIP() << "no C compiler";
  fs::copy(Path("empty.so"), plugin_);
  ExpectGoesOn({}, "stage_backend");
}

// ---- a device that is lost ----------------------------------------------------------------------

/// Returns a device's hits for some steps, then fails. Fans that don't fit it get wrong hits.
class FailingPrefilter : public Stg::internal::sensing::Prefilter {
 public:
  explicit FailingPrefilter(int steps, int times_ahead = 1000)
      : steps_left_(steps), ahead_left_(times_ahead) {}
  /// Acts as a device that is the host's processor. `least`: lowered to the fewest rays per walk.
  FailingPrefilter(int steps, uint64_t* least) : FailingPrefilter(steps) { least_ = least; }

  Stg::internal::sensing::HitLists Walk(Stg::internal::grid::Grid& grid,
                                        const Stg::internal::sensing::DirectionTables&,
                                        const Stg::internal::sensing::RayBatch& batch,
                                        Stg::threads::WorkerPool*) override {
    if (steps_left_-- == 0) throw Stg::internal::sensing::PrefilterError("the cable was pulled");
    lists_ = Stg::test::ListHits(grid, batch, 1);
    uint64_t rays = 0;
    for (const Stg::internal::sensing::DeviceFan& fan : batch.device_fans()) {
      if (fan.fits)
        rays += fan.record.samples;
      else
        std::fill_n(lists_.begin() + 2 * fan.record.first_ray, 2 * fan.record.samples, 0x00030003u);
    }
    if (least_) *least_ = std::min(*least_, rays);
    return {lists_.data(), 1};
  }
  /// From now on, lists come fan by fan, and the device fails after `fans` of them.
  FailingPrefilter& LoseAfterFans(int fans) {
    fans_left_ = fans;
    return *this;
  }
  std::size_t WaitFor(const Stg::internal::sensing::RayBatch& batch, std::size_t fan) override {
    if (fans_left_ < 0) return batch.fans().size();
    if (fans_left_-- == 0) throw Stg::internal::sensing::PrefilterError("the cable was pulled");
    return fan + 1;
  }
  bool UsesHost() const override { return least_ != nullptr; }
  void SendAhead(Stg::internal::grid::Grid&) override {
    if (ahead_left_-- == 0) throw Stg::internal::sensing::PrefilterError("the cable was pulled");
  }
  std::string DeviceName() const override { return "fake device"; }
  const Stg::internal::sensing::PrefilterStatistics& statistics() const override {
    return statistics_;
  }

 private:
  int steps_left_, ahead_left_, fans_left_ = -1;
  uint64_t* least_ = nullptr;
  std::vector<uint32_t> lists_;
  Stg::internal::sensing::PrefilterStatistics statistics_;
};

struct Ended {
  uint64_t hash;
  uint64_t device_steps;
  std::string device, warnings;
};

/// Runs ten steps with a prefilter (null: without).
Ended TenSteps(const std::string& file,
               std::unique_ptr<Stg::internal::sensing::Prefilter> prefilter, unsigned threads = 1,
               bool always = true) {
  Stg::Init(nullptr, nullptr);
  Stg::World world;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  EXPECT_TRUE(world.Load(file));
  if (prefilter) world.engine().tracer.SetPrefilter(std::move(prefilter), always);
  for (Stg::Model* model : world.GetAllModels())
    if (model->GetModelType() == "ranger")
      model->AddParallelCallback(
          Stg::Model::CB_UPDATE, [](Stg::Model*, void*) { return 0; }, nullptr);
  world.engine().SetThreads(threads);
  world.engine().ShareFrom(1);
  for (int i = 0; i < 10; i++) world.Update();
  testing::internal::GetCapturedStdout();
  return {world.StateHash(), world.statistics().device_steps, world.statistics().device,
          testing::internal::GetCapturedStderr()};
}

TEST_F(FaultsTest, DeviceLostDuringARun) {
  const std::string file = Path("w.world");
  const Ended without = TenSteps(file, nullptr);
  EXPECT_EQ(without.warnings, "");
  for (const int steps : {0, 1, 3}) {
    const Ended with = TenSteps(file, std::make_unique<FailingPrefilter>(steps));
    EXPECT_EQ(with.hash, without.hash);
    EXPECT_EQ(with.device_steps, static_cast<uint64_t>(steps));
    EXPECT_EQ(with.device, "");
    EXPECT_EQ(CountOf(with.warnings, "\n"), 1u) << with.warnings;
    for (const char* part :
         {"warning", "fake device", "the cable was pulled", "continuing without"})
      EXPECT_TRUE(Contains(with.warnings, part)) << part << " in " << with.warnings;
  }
  const Ended kept = TenSteps(file, std::make_unique<FailingPrefilter>(1000));
  EXPECT_EQ(kept.hash, without.hash);
  EXPECT_EQ(kept.device_steps, 10u);
  EXPECT_EQ(kept.device, "fake device");
}

// The driver's threads do not exist in the child, which must not wait for them.
TEST_F(FaultsTest, ForkedProcessGoesOnWithoutDevice) {
  if (!DeviceFound()) GTEST_SKIP() << "no OpenCL device";
  const uint64_t hash = TenSteps(Path("w.world"), nullptr).hash;
  std::string message;
  Stg::World world;
  ASSERT_TRUE(world.Load(Path("w.world")));
  world.engine().tracer.SetPrefilter(Stg::LoadPrefilter(Stg::kOpenClPlugin, "", &message), true);
  for (int i = 0; i < 5; i++) world.Update();
  const pid_t child = fork();
  if (child == 0) {
    alarm(static_cast<unsigned>(patience::kPatience));
    for (int i = 0; i < 5; i++) world.Update();
    _exit(world.StateHash() == hash && world.statistics().device_steps == 5 ? 0 : 1);
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  for (int i = 0; i < 5; i++) world.Update();
  EXPECT_EQ(world.statistics().device_steps, 10u);
}

std::string Crowd(int robots) {
  std::string text;
  for (int y = 0; y < robots; y++)
    text += "position( pose [0 " + std::to_string(y) + " 0 0] velocity [1 0 0 0] alwayson 1" +
            " ranger( alwayson 1 pose [0 0 -0.1 0] sensor( range [0 8] fov 360 samples 90 ) ) )\n";
  return text;
}

/// Calls f(robots, threads, file, hash without a device) for crowds of several sizes.
template <typename F>
void FaultsTest::ForEachCrowd(F f) {
  for (const int robots : {3, 16, 17, 40, 70}) {
    Write("crowd.world", Crowd(robots));
    const std::string file = Path("crowd.world");
    const uint64_t hash = TenSteps(file, nullptr).hash;
    for (const unsigned threads : {1u, 2u, 4u}) f(robots, threads, file, hash);
  }
}

// If host and device are both allowed, the host walks a part of a batch to measure its time; in a
// small crowd, or with many threads, a whole batch.
TEST_F(FaultsTest, ProbesOfTheHostDoNotChangeResults) {
  ForEachCrowd([](int robots, unsigned threads, const std::string& file, uint64_t hash) {
    for (const int steps : {2, 3, 4, 1000}) {  // fails before, during and after the measurement
      const Ended with = TenSteps(file, std::make_unique<FailingPrefilter>(steps), threads, false);
      EXPECT_EQ(with.hash, hash) << robots << " robots, " << threads << " threads";
      EXPECT_GE(with.device_steps, static_cast<uint64_t>(std::min(steps, 3)));
      const bool part = static_cast<unsigned>(robots) >= 16 * threads;
      if (part && steps > 3) {
        EXPECT_GE(with.device_steps, 4u) << robots << " " << threads;
      }
    }
  });
}

// If the device is the host's processor, the device walks a part of a batch instead.
TEST_F(FaultsTest, ProbesOfTheDeviceDoNotChangeResults) {
  ForEachCrowd([](int robots, unsigned threads, const std::string& file, uint64_t hash) {
    for (const int steps : {0, 2, 1000}) {
      const auto all = static_cast<uint64_t>(robots) * 90;
      uint64_t least = all;
      const Ended with =
          TenSteps(file, std::make_unique<FailingPrefilter>(steps, &least), threads, false);
      EXPECT_EQ(with.hash, hash) << robots << " robots, " << threads << " threads";
      EXPECT_GE(with.device_steps, static_cast<uint64_t>(std::min(steps, 3)));
      const bool part = static_cast<unsigned>(robots) >= 16 * threads;
      EXPECT_EQ(least < all, part && steps > 0) << robots << " " << threads;
    }
  });
}

TEST_F(FaultsTest, DeviceLostBetweenPartsOfABatch) {
  Write("crowd.world", Crowd(9));
  const std::string file = Path("crowd.world");
  for (const unsigned threads : {1u, 2u}) {
    const Ended without = TenSteps(file, nullptr, threads);
    for (const int fans : {0, 1, 4, 13, 100000}) {
      auto prefilter = std::make_unique<FailingPrefilter>(1000);
      prefilter->LoseAfterFans(fans);
      const Ended with = TenSteps(file, std::move(prefilter), threads);
      EXPECT_EQ(with.hash, without.hash) << "after " << fans << " fans";
      EXPECT_EQ(with.device_steps, fans == 100000 ? 10u : fans < 9 ? 1u : 2u);
      EXPECT_EQ(CountOf(with.warnings, "the cable was pulled"), fans == 100000 ? 0u : 1u)
          << with.warnings;
    }
  }
}

TEST_F(FaultsTest, DeviceLostWhileChangesAreSentBesideCallbacks) {
  Write("crowd.world", Crowd(9));
  const std::string file = Path("crowd.world");
  const Ended without = TenSteps(file, nullptr, 2);
  const Ended with = TenSteps(file, std::make_unique<FailingPrefilter>(1000, 3), 2);
  EXPECT_EQ(with.hash, without.hash);
  EXPECT_EQ(with.device_steps, 4u);
  EXPECT_EQ(with.device, "");
  EXPECT_EQ(CountOf(with.warnings, "the cable was pulled"), 1u) << with.warnings;
}

}  // namespace
