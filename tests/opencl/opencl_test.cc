// SPDX-License-Identifier: GPL-2.0-or-later
//
// The OpenCL prefilter separately: its hit lists compared with those of the host's walk, entry by
// entry, while the grid changes; the choice of a device; forbidden words in the kernels. Tests that
// need a device are skipped without one.

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "sensing/prefilter.hh"
#include "support/device.hh"
#include "support/hit_lists.hh"
#include "support/ray_scene.hh"
#include "world/prefilter_loader.hh"

#if __has_include(<CL/cl.h>)
#define CL_TARGET_OPENCL_VERSION 110
#define CL_USE_DEPRECATED_OPENCL_1_1_APIS
#include <CL/cl.h>
#define STAGE_TEST_HAS_OPENCL_HEADER 1
#endif

namespace {

using ray_scene::RayScene;
using Stg::LoadPrefilter;
using PrefilterPointer = std::unique_ptr<Stg::internal::sensing::Prefilter>;

/// Makes a prefilter with hit lists of `per_ray` entries.
PrefilterPointer MakePrefilter(uint32_t per_ray) {
  std::string message;
  setenv("STAGE_CL_HITS", std::to_string(per_ray).c_str(), 1);
  PrefilterPointer prefilter = LoadPrefilter(Stg::kOpenClPlugin, "", &message);
  EXPECT_TRUE(prefilter) << message;
  unsetenv("STAGE_CL_HITS");
  return prefilter;
}

// ---- hit lists ----------------------------------------------------------------------------------

class HitLists : public testing::TestWithParam<uint32_t> {
 protected:
  void SetUp() override {
    if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
    prefilter_ = MakePrefilter(GetParam());
    ASSERT_TRUE(prefilter_);
  }

  /// Walks the scene's batch on the device and on the host. Returns the number of hits.
  size_t Compare(RayScene* scene) {
    const uint32_t per_ray = GetParam();
    const Stg::internal::sensing::HitLists found =
        prefilter_->Walk(scene->grid(), scene->tables(), scene->batch(), &workers_);
    EXPECT_EQ(found.per_ray, per_ray);
    const std::vector<uint32_t> expected = ListsByWalk(*scene, per_ray);
    EXPECT_EQ(FirstDifference(*scene, expected, found), "");
    EXPECT_EQ(FirstWrongBody(*scene, found), "");
    return static_cast<size_t>(std::count_if(expected.begin(), expected.end(), [](uint32_t hit) {
      return hit != 0 && hit != RAY_NO_HIT;
    }));
  }

  PrefilterPointer prefilter_;
  Stg::threads::WorkerPool workers_{GetParam()};  // 1 to 4 threads
};

TEST_P(HitLists, AreCorrectWhileTheGridChanges) {
  RayScene scene(GetParam());
  scene.grid().TrackChanges(true);
  size_t hits = 0;
  for (int round = 0; round < 150 && !HasFailure(); round++) {
    SCOPED_TRACE(round);
    hits += Compare(&scene);
    // In some rounds the grid changes several times, as if the host had traced alone.
    const int changes = round % 5 == 4 ? 3 : round % 7 == 6 ? 0 : 1;
    for (int i = 0; i < changes; i++) scene.Change();
    scene.MakeBatch();
  }
  EXPECT_GT(hits, 10000u);
}

TEST_P(HitLists, AreRightInOtherGrids) {
  // A separate prefilter for each grid, as in a program with several worlds.
  for (uint64_t seed = 100; seed < 108 && !HasFailure(); seed++) {
    SCOPED_TRACE(seed);
    prefilter_ = MakePrefilter(GetParam());
    ASSERT_TRUE(prefilter_);
    RayScene scene(seed);
    scene.grid().TrackChanges(true);
    for (int round = 0; round < 6; round++) {
      Compare(&scene);
      scene.Change();
      scene.MakeBatch();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(PerRay, HitLists, testing::Values(1u, 2u, 3u, 4u),
                         testing::PrintToStringParamName());

TEST(PrefilterTest, CountsWhatItDoes) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  const PrefilterPointer prefilter = MakePrefilter(2);
  ASSERT_TRUE(prefilter);
  Stg::threads::WorkerPool workers(1);
  RayScene scene(7);
  scene.grid().TrackChanges(true);
  prefilter->Walk(scene.grid(), scene.tables(), scene.batch(), &workers);
  const Stg::internal::sensing::PrefilterStatistics first = prefilter->statistics();
  EXPECT_GT(first.compile_seconds, 0);
  EXPECT_GT(first.walk_seconds, 0);
  EXPECT_EQ(first.bytes_fetched, uint64_t{scene.batch().ray_count()} * 3 * sizeof(uint32_t));
  // The grid is unchanged, so only the batch is sent again.
  prefilter->Walk(scene.grid(), scene.tables(), scene.batch(), &workers);
  const uint64_t again = prefilter->statistics().bytes_sent - first.bytes_sent;
  EXPECT_LT(again * 10, first.bytes_sent);
  EXPECT_EQ(scene.grid().occupancy(0).changed().Count(), 0u);
}

// Without STAGE_CL_HITS, a device with doubles finds ranges, if they have the bits of the host.
TEST(PrefilterTest, FindsRangesIfTheyAreThoseOfTheHost) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  const auto finds_ranges = [] {
    std::string message;
    const PrefilterPointer prefilter = LoadPrefilter(Stg::kOpenClPlugin, "", &message);
    EXPECT_TRUE(prefilter) << message;
    return prefilter && prefilter->ranges().cell && prefilter->ranges().exact;
  };
  if (!finds_ranges()) GTEST_SKIP() << "the device has no doubles";
  setenv("STAGE_CL_OPTIONS", "-DROW_HALF=0.49999999999999994", 1);
  EXPECT_FALSE(finds_ranges());
  unsetenv("STAGE_CL_OPTIONS");
  for (const uint32_t per_ray : {1u, 2u}) {
    const PrefilterPointer prefilter = MakePrefilter(per_ray);
    ASSERT_TRUE(prefilter);
    EXPECT_FALSE(prefilter->ranges().cell || prefilter->ranges().exact);
  }
}

// A device with separate memory returns the lists of a large batch in parts.
TEST(PrefilterTest, LargeBatchesAreSplit) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  using Stg::internal::sensing::Fan;
  setenv("STAGE_CL_MEMORY", "own", 1);
  const PrefilterPointer prefilter = MakePrefilter(1);
  unsetenv("STAGE_CL_MEMORY");
  ASSERT_TRUE(prefilter);
  RayScene scene(3);
  scene.grid().TrackChanges(true);
  Stg::internal::sensing::DirectionTables tables;
  Stg::threads::WorkerPool workers(2);
  for (const uint32_t fans : {10u, 900u, 901u, 1500u}) {
    Stg::internal::sensing::RayBatch batch;
    for (uint32_t i = 0; i < fans; i++) {
      const uint32_t samples = i % 7 == 0 ? 100 : 700;  // two groups, one in each part
      Fan fan;
      fan.layer = Stg::internal::grid::kEverything;
      fan.record.first_direction = tables.Find(6, samples);
      PlaceFan(&fan, Stg::Pose(i * 0.11 - 50, 30 - i * 0.07, 0, i), 90, 1);
      batch.Add(fan, samples, {});
    }
    batch.Close(tables);
    const auto found = prefilter->Walk(scene.grid(), tables, batch, &workers);
    const std::vector<uint32_t> expected = Stg::test::ListHits(scene.grid(), batch, 1);
    size_t there = 0, parts = 0;
    while (there < fans) {
      const size_t from = there;
      there = prefilter->WaitFor(batch, from);
      ASSERT_GT(there, from);
      parts++;
      for (size_t i = from; i < there; i++) {
        const auto& record = batch.fans()[i].record;
        for (size_t ray = record.first_ray; ray < record.first_ray + record.samples; ray++) {
          ASSERT_EQ(found.ListOf(ray)[0], expected[2 * ray + 1]) << "fan " << i;
          const bool hit = expected[2 * ray + 1] != RAY_NO_HIT;
          ASSERT_EQ(hit ? found.BodyOf(ray) : 0, hit ? expected[2 * ray] : 0) << "fan " << i;
        }
      }
    }
    EXPECT_EQ(parts, batch.ray_count() < 500'000 ? 1u : 3u);
  }
}

// ---- the choice of a device ---------------------------------------------------------------------

/// The parts of "kind name (platform)", the result of DeviceName().
struct DeviceNames {
  std::string kind, name, platform;
};

DeviceNames Split(const std::string& text) {
  const size_t space = text.find(' '), bracket = text.rfind(" (");
  return {text.substr(0, space), text.substr(space + 1, bracket - space - 1),
          text.substr(bracket + 2, text.size() - bracket - 3)};
}

std::string SwapCase(std::string text) {
  for (char& c : text) {
    const auto letter = static_cast<unsigned char>(c);
    c = static_cast<char>(std::islower(letter) ? std::toupper(letter) : std::tolower(letter));
  }
  return text;
}

class DeviceChoice : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
    std::string message;
    const PrefilterPointer best = LoadPrefilter(Stg::kOpenClPlugin, "", &message);
    ASSERT_TRUE(best) << message;
    best_ = best->DeviceName();
    names_ = Split(best_);
  }

  /// Name of the device selected by `choice`.
  static std::string Chosen(const std::string& choice) {
    std::string message;
    const PrefilterPointer prefilter = LoadPrefilter(Stg::kOpenClPlugin, choice, &message);
    return prefilter ? prefilter->DeviceName() : "none";
  }
  /// Expects failure with a message that names the choice and lists the devices.
  static void ExpectRefused(const std::string& choice) {
    std::string message;
    EXPECT_EQ(LoadPrefilter(Stg::kOpenClPlugin, choice, &message), nullptr) << choice;
    EXPECT_NE(message.find("\"" + choice + "\""), std::string::npos) << message;
    EXPECT_NE(message.find(Stg::ListDevices(Stg::kOpenClPlugin)), std::string::npos) << message;
  }

  std::string best_;
  DeviceNames names_;
};

TEST_F(DeviceChoice, ByKind) {
  EXPECT_EQ(Chosen("auto"), best_);
  EXPECT_EQ(Chosen("AUTO"), best_);
  EXPECT_EQ(Chosen("auto:0"), best_);
  EXPECT_EQ(Chosen(names_.kind), best_);
  EXPECT_EQ(Chosen(SwapCase(names_.kind)), best_);
  EXPECT_EQ(Chosen(names_.kind + ":0"), best_);
  for (const std::string kind : {"gpu", "cpu"}) {
    if (Stg::ListDevices(Stg::kOpenClPlugin).find("  " + kind + ": ") == std::string::npos)
      ExpectRefused(kind);
    else
      EXPECT_EQ(Split(Chosen(kind)).kind, kind);
  }
}

TEST_F(DeviceChoice, ByName) {
  for (const std::string& name : {names_.name, names_.platform}) {
    ASSERT_GE(name.size(), 3u);
    EXPECT_EQ(Chosen(name), best_);
    EXPECT_EQ(Chosen(SwapCase(name)), best_);
    EXPECT_EQ(Chosen(name + ":0"), best_);
    EXPECT_EQ(Chosen(name.substr(1, name.size() - 2)), best_);
    ExpectRefused(name + "x");
  }
}

TEST_F(DeviceChoice, WithAWrongNameOrIndex) {
  for (const std::string choice :
       {"no such device", "auto:99", "cpu:999999", "gpu:99", ":99", "0", "cpu:x", "cpu:-1"})
    ExpectRefused(choice);
  ExpectRefused(names_.name + ":99");
}

TEST_F(DeviceChoice, List) {
  const std::string list = Stg::ListDevices(Stg::kOpenClPlugin);
  EXPECT_NE(list.find("  " + names_.kind + ": " + names_.name + " (" + names_.platform),
            std::string::npos)
      << list;
  const testing::Matcher<const std::string&> form = testing::MatchesRegex(
      "  (gpu|cpu|accelerator): .* \\(.*, OpenCL .*, [0-9]+ compute units, [0-9]+ MiB\\)");
  std::istringstream lines(list);
  for (std::string line; std::getline(lines, line);) EXPECT_TRUE(form.Matches(line)) << line;
}

/// Page faults of ended child processes; grows if a child process was used.
long FaultsOfChildren() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

// Drivers are tried in a child process first, but only once per process.
TEST_F(DeviceChoice, DriversAreAskedOnce) {
  const std::string list = Stg::ListDevices(Stg::kOpenClPlugin);
  const long faults = FaultsOfChildren();
  EXPECT_GT(faults, 0) << "the first time there was a child";
  for (int i = 0; i < 3; i++) EXPECT_EQ(Stg::ListDevices(Stg::kOpenClPlugin), list);
  ExpectRefused("no such device");
  EXPECT_EQ(FaultsOfChildren(), faults);
}

// ---- the kernels' text --------------------------------------------------------------------------

std::string SourceFile(const std::string& name) {
  const char* source = std::getenv("STAGE_SOURCE_DIR");
  std::ifstream in(std::string(source ? source : ".") + "/kernels/" + name);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string WithoutComments(std::string text) {
  for (size_t at; (at = text.find("/*")) != std::string::npos;)
    text.replace(at, text.find("*/", at) + 2 - at, " ");
  return text;
}

std::set<std::string> WordsOf(const std::string& text) {
  std::set<std::string> words;
  std::string word;
  for (const char c : text + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '_') {
      word += c;
    } else {
      words.insert(word);
      word.clear();
    }
  }
  return words;
}

TEST(KernelText, IsPlainAndPortable) {
  std::set<std::string> all;
  // Ranges and rows need doubles, and are not compiled for devices without them.
  for (const std::string name : {"ray_walk.h", "records.h", "prefilter.cl"}) {
    const std::string text = WithoutComments(SourceFile(name));
    ASSERT_GT(text.size(), 500u) << name << " can't be read";
    const std::set<std::string> words = WordsOf(text);
    // Local memory and barriers give no speed and break some drivers; doubles and newer
    // built-in functions are not always supported; fast math differs between devices.
    for (const std::string word :
         {"barrier", "__local", "local", "double", "half", "popcount", "ctz", "clz", "fma", "mad",
          "sqrt", "native_divide", "native_recip", "half_divide", "printf", "atomic_add"})
      EXPECT_FALSE(words.contains(word)) << word << " in " << name;
    all.insert(words.begin(), words.end());
  }
  EXPECT_TRUE(all.contains("walk_fans") && all.contains("ray_next"));
}

// ---- compiled kernels ---------------------------------------------------------------------------

#ifdef STAGE_TEST_HAS_OPENCL_HEADER

/// The OpenCL library, loaded at run time; the tests are not linked to it.
class OpenClLibrary {
 public:
  OpenClLibrary() : handle_(dlopen("libOpenCL.so.1", RTLD_NOW)) {}
  explicit operator bool() const { return handle_ != nullptr; }
  template <typename Function>
  Function* Find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(handle_, name));
  }

 private:
  void* handle_;
};

#define STAGE_FIND(library, function) (library).Find<decltype(function)>(#function)

TEST(KernelFacts, LeaveRoomForLargeWorkGroups) {
  // The plug-in first tries the drivers in a child process.
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  const OpenClLibrary library;
  if (!library) GTEST_SKIP() << "there is no libOpenCL.so.1";

  cl_uint count = 0;
  cl_platform_id platforms[16];
  ASSERT_EQ(STAGE_FIND(library, clGetPlatformIDs)(16, platforms, &count), CL_SUCCESS);
  cl_device_id device = nullptr;
  for (cl_uint i = 0; i < std::min(count, 16u) && !device; i++)
    STAGE_FIND(library, clGetDeviceIDs)(platforms[i], CL_DEVICE_TYPE_ALL, 1, &device, nullptr);
  ASSERT_NE(device, nullptr);
  cl_int error = CL_SUCCESS;
  const cl_context context =
      STAGE_FIND(library, clCreateContext)(nullptr, 1, &device, nullptr, nullptr, &error);
  ASSERT_EQ(error, CL_SUCCESS);
  const std::string text =
      SourceFile("ray_walk.h") + SourceFile("records.h") + SourceFile("prefilter.cl");
  const char* source = text.c_str();
  const cl_program program =
      STAGE_FIND(library, clCreateProgramWithSource)(context, 1, &source, nullptr, &error);
  ASSERT_EQ(error, CL_SUCCESS);
  ASSERT_EQ(STAGE_FIND(library, clBuildProgram)(program, 1, &device, "-cl-std=CL1.1 -Werror",
                                                nullptr, nullptr),
            CL_SUCCESS);
  for (const char* name : {"walk_fans", "update_words"}) {
    const cl_kernel kernel = STAGE_FIND(library, clCreateKernel)(program, name, &error);
    ASSERT_EQ(error, CL_SUCCESS) << name;
    size_t work_group = 0;
    cl_ulong local_memory = 1;
    const auto ask = STAGE_FIND(library, clGetKernelWorkGroupInfo);
    ask(kernel, device, CL_KERNEL_WORK_GROUP_SIZE, sizeof work_group, &work_group, nullptr);
    ask(kernel, device, CL_KERNEL_LOCAL_MEM_SIZE, sizeof local_memory, &local_memory, nullptr);
    EXPECT_GE(work_group, 128u) << name;
    EXPECT_EQ(local_memory, 0u) << name;
    STAGE_FIND(library, clReleaseKernel)(kernel);
  }
  STAGE_FIND(library, clReleaseProgram)(program);
  STAGE_FIND(library, clReleaseContext)(context);
}

#endif

}  // namespace
