// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rows on devices against rows on the host: all columns have the same bits after each of many
// steps. The kernels' text is compiled for the host, too.

#include "rows/device_rows.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <memory>
#include <numeric>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "control/stock_list.hh"
#include "kernels/row_behaviour.h"
#include "rows/device_columns.hh"
#include "rows/device_controls.hh"
#include "rows/row_bridge.hh"
#include "support/closed_world.hh"
#include "support/device.hh"
#include "support/host_row_device.hh"
#include "support/model_testing.hh"
#include "support/random_source.hh"
#include "world/controllers.hh"
#include "world/engine.hh"

namespace {

using Stg::rows::DeviceRows;
using Stg::rows::RowDevice;
using Stg::rows::Rows;
using Stg::test::ClosedWorldKind;
using Stg::test::RandomSource;

using ScenePointer = std::shared_ptr<const Stg::rows::Scene>;

/// Numbers of work-items of a device; kHost is the kernels' text on the host.
constexpr uint32_t kHost = 1000, kChosen = 0;

std::unique_ptr<RowDevice> MakeDevice(uint32_t work_items) {
  if (work_items == kHost) return std::make_unique<Stg::test::HostRowDevice>();
  std::string message;
  auto device = Stg::rows::OpenRowDevice("", work_items, &message);
  EXPECT_TRUE(device) << message;
  return device;
}

using Stg::rows::VariedNumber;
using Stg::rows::VariedProperty;

/// Some of the numbers that worlds may have of their own.
std::vector<VariedNumber> NumbersToVary(const Stg::World& world, RandomSource* random) {
  constexpr uint32_t kMostElements = 8, kMostSensors = 3;
  std::vector<VariedNumber> numbers;
  for (const Stg::Model* model : world.engine().models)
    for (auto property = VariedProperty::kMass; property < VariedProperty::kNone;
         property = static_cast<VariedProperty>(static_cast<int>(property) + 1)) {
      if (random->OneIn(2)) continue;
      for (uint32_t sensor = 0; sensor < kMostSensors; sensor++)
        for (uint32_t element = 0; element < kMostElements; element++)
          if (const VariedNumber number{model->GetId(), sensor, property, element};
              Stg::RowBridge::CanVary(world, number))
            numbers.push_back(number);
    }
  return numbers;
}

/// Chooses such numbers.
std::function<std::vector<VariedNumber>(const Stg::World&)> SomeNumbers(RandomSource* random) {
  return [random](const Stg::World& world) { return NumbersToVary(world, random); };
}

/// A number of a world, in the unit of its file. Noise is often 0.
double SomeValue(const VariedNumber& number, RandomSource* random) {
  const bool is_least = number.element % 2 == 0;
  switch (number.property) {
    case VariedProperty::kMass:
      return random->Real(0.1, 30);
    case VariedProperty::kVelocityBounds:
    case VariedProperty::kAccelerationBounds: {
      const double most = random->Real(0.1, number.element / 2 == 3 ? 90 : 1.5);
      return is_least ? -most : most;
    }
    case VariedProperty::kOdomError:
      return random->Real(-0.1, 0.1);
    case VariedProperty::kOdomNoise:
      return random->OneIn(2) ? 0 : random->Real(0, 0.05);
    case VariedProperty::kNoise:
      return random->OneIn(2) ? 0 : random->Real(0, number.element == 0 ? 1e-3 : 0.1);
    case VariedProperty::kWheelbase:
      return random->Real(0.2, 2);
    case VariedProperty::kSteeringLimit:
    case VariedProperty::kSteeringRate:
      return random->Real(0, 60);
    default:
      return random->Real(0, 1);
  }
}

std::vector<double> SomeValues(const Stg::rows::Scene& scene, RandomSource* random) {
  std::vector<double> values;
  for (size_t k = 0; k < scene.varied.size(); k++) {
    const VariedNumber& number = scene.varied[k].number;
    const bool has_none =
        number.property == VariedProperty::kOdomNoise || number.property == VariedProperty::kNoise;
    const bool follows = k > 0 && number.element > 0 && has_none;
    // All numbers of the noise of a sensor or of odometry are 0 in some worlds.
    const bool is_zero = follows && values[k - 1] == 0 && random->OneIn(2);
    values.push_back(is_zero ? 0 : SomeValue(number, random));
  }
  return values;
}

/// A scene whose robots and rangers run, except those whose bit in `idle`, at their id modulo 64,
/// is set. `choose`: the numbers that differ between worlds; empty: none do.
using Choose = std::function<std::vector<VariedNumber>(const Stg::World&)>;
ScenePointer SceneOf(const std::string& text, uint64_t idle, const Choose& choose = {}) {
  Stg::InitLibrary();
  Stg::RunOptions options;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  for (Stg::Model* model : world->engine().models)
    if ((model->GetModelType() == "position" || model->GetModelType() == "ranger") &&
        ((idle >> (model->GetId() % 64)) & 1) == 0)
      model->Subscribe();
  std::vector<VariedNumber> numbers;
  if (choose) numbers = choose(*world);
  std::string reason;
  ScenePointer scene = Stg::RowBridge::MakeScene(std::move(world), &reason, numbers);
  EXPECT_TRUE(scene) << reason << "\n" << text;
  return scene;
}

/// Gives a random command to a robot of rows.
void Command(RandomSource* random, Rows* rows, size_t i) {
  const Stg::rows::Mover& mover = rows->scene().movers[i % rows->scene().movers.size()];
  if (!mover.runs) return;
  const int mode = random->Int(0, 6);
  rows->columns.mode[i] = static_cast<uint8_t>(mover.steers || mode > 2 ? 1 : mode);
  rows->columns.command[i] = {random->Real(-1, 1), random->Real(-1, 1), random->Real(-2, 2)};
}

/// Gives robots with stage/behaviour other behaviours.
void Rethink(RandomSource* random, Rows* rows) {
  const Stg::rows::Controls& controls = rows->scene().controls;
  for (size_t world = 0; world < rows->size(); world++)
    for (const Stg::rows::ControlGroup& group : controls.groups) {
      if (group.controller != Stg::control::BehaviourController()) continue;
      double* memory = &rows->columns.memory[world * controls.memory_count + group.first_memory];
      for (size_t i = 0; i < group.controls.size(); i++, memory += group.memory_size) {
        if (!random->OneIn(4)) continue;
        memory[Stg::ROW_BEHAVIOUR_KIND] = random->Int(-1, Stg::ROW_BEHAVIOURS);
        for (int k = Stg::ROW_BEHAVIOUR_X; k < Stg::ROW_BEHAVIOUR_SIZE; k++)
          memory[k] = random->Real(k == Stg::ROW_BEHAVIOUR_SPEED ? 0 : -2, 2);
      }
    }
}

/// Names the first element of a column that differs; empty if none does.
std::string Difference(const Rows& host, const Rows& device) {
  std::string text;
  std::vector<std::string> of_host(Stg::ROW_COLUMNS), of_device(Stg::ROW_COLUMNS);
  const auto save = [](std::vector<std::string>* to) {
    return [to](int id, const auto* column) {
      using T = typename std::decay_t<decltype(*column)>::value_type;
      std::vector<std::byte> bytes(column->size() * Stg::rows::kSizeOnDevice<T>);
      Stg::rows::ToDevice(column->data(), column->size(), bytes.data());
      (*to)[static_cast<size_t>(id)].assign(reinterpret_cast<const char*>(bytes.data()),
                                            bytes.size());
    };
  };
  Stg::rows::ForEachDeviceColumn(&host.columns, save(&of_host));
  Stg::rows::ForEachDeviceColumn(&device.columns, save(&of_device));
  for (size_t id = 0; id < Stg::ROW_COLUMNS; id++) {
    if (of_host[id] == of_device[id]) continue;
    size_t at = 0;
    while (of_host[id][at] == of_device[id][at]) at++;
    text += " column " + std::to_string(id) + " differs from byte " + std::to_string(at) + " of " +
            std::to_string(of_host[id].size()) + " on";
  }
  return text;
}

/// Rows on a device and on the host that get the same commands.
class Comparison {
 public:
  Comparison(const ScenePointer& scene, size_t worlds, uint32_t work_items, RandomSource* random,
             size_t contact_bytes = Stg::rows::kContactBytes)
      : random_(*random),
        host_(scene, Seeds(worlds, random)),
        read_(scene, Seeds(worlds, random)),
        device_(scene, worlds, MakeDevice(work_items), 0, contact_bytes) {
    device_.Write(host_);
    if (scene->varied.empty()) return;
    std::vector<uint32_t> all(worlds);
    std::iota(all.begin(), all.end(), 0u);
    Reset(all);
  }

  Rows& host() { return host_; }
  void Step(uint32_t steps) {
    const auto scratch = host_.MakeScratch();
    const size_t movers = host_.scene().movers.size();
    std::vector<Stg::row_given_t> given;
    for (size_t i = 0; i < host_.size() * movers; i++) {
      if (!random_.OneIn(10)) continue;
      Command(&random_, &host_, i);
      const Stg::rows::Planar& command = host_.columns.command[i];
      given.push_back({{command.x, command.y, command.a},
                       static_cast<uint32_t>(i / movers),
                       static_cast<uint32_t>(i % movers),
                       host_.columns.mode[i],
                       0});
    }
    if (random_.OneIn(3)) {
      Rethink(&random_, &host_);
      device_.Write(host_, 1u << Stg::ROW_MEMORY);
    }
    if (random_.OneIn(2))
      device_.Give(given);
    else
      device_.Write(host_, 1u << Stg::ROW_COMMAND | 1u << Stg::ROW_MODE);
    const uint32_t unseen = random_.OneIn(3) ? static_cast<uint32_t>(random_.Int(1, 3)) : 0;
    for (size_t i = 0; i < host_.size(); i++) host_.Step(i, steps, scratch.get(), unseen);
    device_.Step(steps, unseen);
    // A device casts all rays or none, the host only those that change something.
    if (unseen > 0) device_.Write(host_, 1u << Stg::ROW_RANGES | 1u << Stg::ROW_BRIGHTNESS);
  }
  /// Puts some worlds into the present states of one or several of them, some with seeds of their
  /// own.
  void RestoreSome() {
    std::vector<Rows> starts;
    for (int count = random_.Int(1, 3); count > 0; count--) {
      starts.emplace_back(host_.shared_scene(), std::array{uint64_t{1}});
      starts.back().Copy(0, host_, random_.Next() % host_.size());
    }
    std::vector<const Rows*> all;
    for (const Rows& start : starts) all.push_back(&start);
    const bool reseeds = random_.OneIn(2);
    std::vector<uint32_t> worlds, start_of;
    for (size_t i = 0; i < host_.size(); i++) {
      if (random_.OneIn(3)) continue;
      worlds.push_back(static_cast<uint32_t>(i));
      start_of.push_back(static_cast<uint32_t>(random_.Next() % starts.size()));
      host_.Copy(i, starts[start_of.back()], 0);
      if (reseeds && random_.OneIn(2)) Stg::RowBridge::Reseed(&host_, i, random_.Next());
    }
    const Stg::rows::ColumnSet random_numbers =
        1u << Stg::ROW_SEED | 1u << Stg::ROW_RANDOM | 1u << Stg::ROW_NOISE;
    device_.Restore(worlds, all, start_of, host_,
                    random_.OneIn(2) ? Stg::rows::kAllColumns
                    : reseeds        ? random_numbers
                                     : 0);
  }
  /// Watches some movers during a few steps. Says whether what was noted differs; empty if it does
  /// not.
  std::string WatchedDifference() {
    std::vector<uint32_t> movers;
    for (uint32_t i = 0; i < host_.scene().movers.size(); i++)
      if (random_.OneIn(2)) movers.push_back(i);
    const auto moments = static_cast<size_t>(random_.Int(1, 3));
    device_.Watch(movers, moments);
    const auto scratch = host_.MakeScratch();
    std::vector<std::vector<double>> expected;
    for (size_t moment = 0; moment < moments; moment++) {
      if (moment > 0) {
        device_.Step(1);
        for (size_t i = 0; i < host_.size(); i++) host_.Step(i, 1, scratch.get());
      }
      std::vector<uint32_t> worlds;
      for (uint32_t world = 0; world < host_.size(); world++) {
        const bool noted = !random_.OneIn(4);
        if (noted) worlds.push_back(world);
        expected.push_back(noted ? NumbersOf(world, movers) : std::vector<double>());
      }
      device_.NoteWatched(worlds, moment);
    }
    const std::span<const double> read = device_.ReadWatched(moments);
    const size_t count = movers.size() * DeviceRows::kWatchedNumbers;
    if (read.size() != expected.size() * count) return "there are not as many numbers";
    for (size_t i = 0; i < expected.size(); i++)
      if (!expected[i].empty() && !std::ranges::equal(read.subspan(i * count, count), expected[i]))
        return "watched movers differ";
    return "";
  }
  void ResetSome() {
    std::vector<uint32_t> worlds;
    for (size_t i = 0; i < host_.size(); i++)
      if (random_.OneIn(2)) worlds.push_back(static_cast<uint32_t>(i));
    Reset(worlds);
  }
  /// Resets some worlds, which keep their seeds and numbers.
  void ResetFlagged() {
    const size_t count = host_.scene().varied.size();
    std::vector<uint8_t> flags(host_.size());
    for (size_t i = 0; i < flags.size(); i++) {
      flags[i] = random_.OneIn(2);
      if (!flags[i]) continue;
      std::vector<double> numbers;
      for (size_t k = 0; k < count; k++)
        numbers.push_back(host_.columns.varied[i * count + k] / host_.scene().varied[k].unit);
      host_.Reset(i, host_.columns.seed[i], numbers);
    }
    device_.device().ResetFlagged({flags.data(), flags.size(), false});
  }
  /// Lets the host make steps of what the device has read back, and the device go on from there.
  void HandOver(uint64_t steps) {
    device_.Read(&read_);
    const auto scratch = host_.MakeScratch();
    for (size_t i = 0; i < host_.size(); i++) {
      read_.Step(i, steps, scratch.get());
      host_.Step(i, steps, scratch.get());
    }
    device_.Write(read_);
  }
  std::string Difference() {
    device_.Read(&read_);
    return ::Difference(host_, read_);
  }

 private:
  /// The numbers of these movers of a world that are watched.
  std::vector<double> NumbersOf(size_t world, const std::vector<uint32_t>& movers) const {
    std::vector<double> numbers;
    for (const uint32_t mover : movers) {
      const size_t i = world * host_.scene().movers.size() + mover;
      const Stg::rows::Planar &pose = host_.columns.pose[i], &v = host_.columns.velocity[i];
      numbers.insert(numbers.end(), {pose.x, pose.y, pose.a, v.x, v.y, v.a,
                                     static_cast<double>(host_.columns.stalled[i])});
    }
    return numbers;
  }
  /// Resets worlds with other seeds, and other numbers if these vary.
  void Reset(const std::vector<uint32_t>& worlds) {
    std::vector<uint64_t> seeds;
    std::vector<std::vector<double>> values;
    for (const uint32_t world : worlds) {
      seeds.push_back(random_.Next());
      values.push_back(SomeValues(host_.scene(), &random_));
      host_.Reset(world, seeds.back(), values.back());
    }
    const std::vector<std::span<const double>> given(values.begin(), values.end());
    device_.Reset(worlds, seeds, given);
  }
  static std::vector<uint64_t> Seeds(size_t worlds, RandomSource* random) {
    std::vector<uint64_t> seeds(worlds);
    for (uint64_t& seed : seeds) seed = random->Next();
    return seeds;
  }

  RandomSource& random_;
  Rows host_, read_;
  DeviceRows device_;
};

/// Number of random worlds of each kind; more for a long search.
uint64_t Worlds(uint64_t usual) {
  const char* const wanted = std::getenv("STAGE_RANDOM_WORLDS");
  return wanted ? std::strtoull(wanted, nullptr, 10) : usual;
}

struct Case {
  uint32_t work_items;
  bool exact, outlines;
};

class DeviceRowsTest : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    if (GetParam().work_items == kHost) return;
    if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  }
};

TEST_P(DeviceRowsTest, StepsHaveTheBitsOfTheHostInAllColumns) {
  const auto [work_items, exact, outlines] = GetParam();
  size_t stalls = 0, hits = 0, empty_packs = 0, wide = 0, noisy = 0, placed_by_seed = 0;
  size_t controlled = 0, remembering = 0, hindered = 0, pushed = 0, varied = 0;
  const auto solved = Stg::test::HostRowDevice::islands;
  const uint64_t in_shared_room = Stg::test::HostRowDevice::worlds_in_shared_room;
  for (uint64_t seed = 1; seed <= Worlds(work_items == kHost ? 60 : 16); seed++) {
    RandomSource random(seed * 100 + exact + 2 * outlines);
    const ClosedWorldKind kind{outlines, exact, random.Int(1, 8), random.Real(1, 6), seed % 2 == 0};
    const std::string text = ClosedWorld(kind, &random);
    const ScenePointer scene = SceneOf(text, random.OneIn(3) ? random.Next() & random.Next() : 0,
                                       seed % 3 == 1 ? SomeNumbers(&random) : Choose());
    ASSERT_TRUE(scene);
    ASSERT_EQ(WhyNotOnDevice(scene), "");
    // Contacts in the memory of each world, and in that which they share.
    Comparison comparison(scene, 3, work_items, &random,
                          seed % 3 == 0 ? 0 : Stg::rows::kContactBytes);
    for (int round = 0; round < 40; round++) {
      comparison.Step(round < 20 ? 1 : 5);
      ASSERT_EQ(comparison.Difference(), "") << seed << " round " << round << "\n" << text;
      ASSERT_EQ(comparison.WatchedDifference(), "") << seed << " round " << round << "\n" << text;
      if (round % 10 == 4) comparison.RestoreSome();
      if (round % 10 == 6) comparison.ResetSome();
      if (round % 10 == 8) comparison.HandOver(3);
      const Stg::rows::Columns& c = comparison.host().columns;
      for (const uint8_t stalled : c.stalled) stalls += stalled;
      for (const uint8_t brightness : c.brightness) hits += brightness > 0;
      for (const double stored : c.stored) empty_packs += stored == 0;
      for (const uint8_t is_hindered : c.hindered) hindered += is_hindered;
      for (size_t i = 0; i < c.before.size(); i++)
        pushed += !scene->movers[i % scene->movers.size()].robot && !(c.before[i] == c.pose[i]);
    }
    placed_by_seed += scene->populations != nullptr;
    wide += !scene->narrow;
    noisy += !comparison.host().columns.noise.empty();
    varied += scene->varies_movers && scene->varies_noise;
    for (const auto& group : scene->controls.groups) controlled += group.controls.size();
    for (const double number : comparison.host().columns.memory) remembering += number != 0;
  }
  EXPECT_GT(stalls, 100u);
  EXPECT_GT(hits, 1000u);
  EXPECT_GT(empty_packs, 5u);
  const size_t few = work_items == kHost ? 3 : 0;  // devices are slow
  EXPECT_GT(placed_by_seed, few);
  EXPECT_GT(wide, 0u);
  EXPECT_GT(noisy, few);
  EXPECT_GT(varied, few);
  EXPECT_GT(controlled, 10u);
  EXPECT_GT(remembering, 20u);
  EXPECT_EQ(hindered > 300, outlines) << hindered;
  EXPECT_EQ(pushed > 30, outlines) << pushed;
  if (work_items != kHost || !outlines) return;
  for (const size_t kind : {Stg::ROW_SMALL, Stg::ROW_SLOW, Stg::ROW_LARGE})
    EXPECT_GT(Stg::test::HostRowDevice::islands[kind] - solved[kind], 20u) << kind;
  EXPECT_GT(Stg::test::HostRowDevice::worlds_in_shared_room - in_shared_room, 20u);
}

INSTANTIATE_TEST_SUITE_P(Kinds, DeviceRowsTest,
                         testing::Values(Case{kHost, false, false}, Case{kHost, true, false},
                                         Case{kChosen, false, false}, Case{kChosen, true, false},
                                         Case{5, true, false}, Case{kHost, false, true},
                                         Case{kHost, true, true}, Case{kChosen, false, true},
                                         Case{kChosen, true, true}, Case{32, false, true}));

constexpr char kTwoRobots[] = R"(
contacts "cells"
define robot position( size [0.3 0.3 0.3] odom_error [0 0 0 0] localization "odom"
  ranger( sensor( range [0 2] fov 360 samples 12 ) ) )
robot( pose [0 0 0 0] )
robot( pose [1 0 0 180] )
)";

/// A scene in which the masses and bounds of models differ between worlds, or nothing does.
ScenePointer SceneWithMasses(const std::string& text, bool varies) {
  return SceneOf(text, 0, [varies](const Stg::World& world) {
    std::vector<VariedNumber> numbers;
    for (uint32_t model = 0; varies && model < world.engine().models.size(); model++)
      for (const auto property : {VariedProperty::kMass, VariedProperty::kVelocityBounds})
        if (const VariedNumber number{model, 0, property,
                                      property == VariedProperty::kMass ? 0u : 1u};
            Stg::RowBridge::CanVary(world, number))
          numbers.push_back(number);
    return numbers;
  });
}

TEST(DeviceRowsSizesTest, AnyNumberOfWorldsHasTheBitsOfTheHost) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  for (const size_t worlds : {1, 33, 200, 1000}) {
    SCOPED_TRACE(worlds);
    RandomSource random(worlds);
    const ScenePointer scene =
        SceneOf(kTwoRobots, 0, worlds < 1000 ? SomeNumbers(&random) : Choose());
    Comparison comparison(scene, worlds, kChosen, &random);
    for (int round = 0; round < 8; round++) {
      comparison.Step(4);
      EXPECT_EQ(comparison.Difference(), "") << round;
      comparison.ResetSome();
    }
    EXPECT_EQ(comparison.Difference(), "");
  }
}

/// A device resets worlds by itself if their states after loading do not depend on their seeds.
TEST(DeviceRowsFlagsTest, WorldsThatTheDeviceResetsKeepTheirProperties) {
  std::string text = kTwoRobots;
  text.replace(text.find("localization \"odom\""), 19, "friction 0.5");
  for (const bool varies : {false, true})
    for (const uint32_t work_items : {kHost, kChosen}) {
      if (work_items == kChosen && !device::WhyNone().empty()) continue;
      RandomSource random(varies + 1);
      const ScenePointer scene = SceneWithMasses(text, varies);
      Comparison comparison(scene, 20, work_items, &random);
      for (int round = 0; round < 8; round++) {
        comparison.Step(5);
        comparison.ResetFlagged();
        ASSERT_EQ(comparison.Difference(), "") << work_items << " round " << round;
      }
      EXPECT_EQ(comparison.host().columns.properties.size(), varies ? 40u : 0u);
    }
}

/// With many islands, those that take long are given up, and solved after the others.
TEST(DeviceRowsSizesTest, ManyIslandsHaveTheBitsOfTheHost) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  const ScenePointer scene = SceneOf(R"(
define robot position( size [0.2 0.2 0.2] drive "omni" )
robot( pose [-0.3 -0.3 0 10] )
robot( pose [0.3 -0.3 0 60] )
robot( pose [-0.3 0.3 0 110] )
robot( pose [0.3 0.3 0 200] )
model( pose [0 -0.6 0 0] size [1.2 0.05 1] )
model( pose [0 0.6 0 0] size [1.2 0.05 1] )
model( pose [-0.6 0 0 0] size [0.05 1.2 1] )
model( pose [0.6 0 0 0] size [0.05 1.2 1] )
)",
                                     0);
  ASSERT_TRUE(scene);
  const auto solved = Stg::test::HostRowDevice::islands;
  for (const uint32_t work_items : {kHost, kChosen}) {
    RandomSource random(5);
    Comparison comparison(scene, 1000, work_items, &random);
    for (int round = 0; round < 8; round++) {
      comparison.Step(5);
      ASSERT_EQ(comparison.Difference(), "") << round;
    }
  }
  for (size_t kind = 0; kind < Stg::ROW_LARGE; kind++)
    EXPECT_GT(Stg::test::HostRowDevice::islands[kind] - solved[kind], 100u) << kind;
}

/// Coordinates of contacts are relative to a place nearby.
TEST(DeviceRowsFarTest, ContactsFarFromTheOriginHaveTheBitsOfTheHost) {
  const ScenePointer scene = SceneOf(R"(
define robot position( size [0.3 0.3 0.3] drive "omni" friction 0.3 )
robot( pose [100000.3 -70000.2 0 10] )
robot( pose [100000.7 -70000.2 0 60] pushable 1 )
model( pose [100000.5 -70000 0 0] size [3 0.1 1] )
)",
                                     0);
  ASSERT_TRUE(scene);
  RandomSource random(1);
  Comparison comparison(scene, 5, kHost, &random);
  size_t hindered = 0;
  for (int round = 0; round < 100; round++) {
    comparison.Step(4);
    ASSERT_EQ(comparison.Difference(), "") << round;
    for (const uint8_t is_hindered : comparison.host().columns.hindered) hindered += is_hindered;
  }
  EXPECT_GT(hindered, 50u);
}

TEST(DeviceRowsReasonsTest, RunningFindersAreRefusedWithAReason) {
  Stg::InitLibrary();
  Stg::RunOptions options;
  options.listed = false;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content("contacts \"cells\"\nposition( fiducial() )\n");
  ASSERT_TRUE(world->Load(content, "t.world"));
  Stg::test::SubscribeToMost(world.get(), 0);
  std::string reason;
  const ScenePointer scene = Stg::RowBridge::MakeScene(std::move(world), &reason);
  ASSERT_TRUE(scene) << reason;
  EXPECT_NE(Stg::rows::WhyNotOnDevice(scene).find("fiducial finder"), std::string::npos);
}

class DoNothing : public Stg::BatchController {
 public:
  std::shared_ptr<const Stg::ControllerParameters> Prepare(Stg::ControllerSetup*) const override {
    return nullptr;
  }
  void Step(const Stg::ControllerBatch&) const override {}
};

TEST(DeviceRowsReasonsTest, ControllersThatAreNotBuiltInAreLeftToTheHost) {
  Stg::InitLibrary();
  static const DoNothing controller;
  ASSERT_TRUE(Stg::RegisterBatchController("nothing", &controller));
  const std::string text = "contacts \"cells\"\nposition( name \"r\" ctrl \"";
  for (const bool is_built_in : {false, true}) {
    const ScenePointer scene =
        SceneOf(text + (is_built_in ? "stage/goal x=1 y=1" : "nothing") + "\" )", 0);
    EXPECT_EQ(Stg::rows::WhyNotOnDevice(scene), "");
    EXPECT_EQ(Stg::rows::WhyNotControls(*scene),
              is_built_in ? "" : "the controller of \"r\" is not built in");
    const DeviceRows rows(scene, 2, std::make_shared<Stg::test::HostRowDevice>());
    EXPECT_EQ(rows.has_controls_on_host(), !is_built_in);
  }
}

TEST(DeviceRowsReasonsTest, ContactsThatMayTakeTooMuchMemoryAreRefusedWithAReason) {
  std::string text =
      "define wall model( size [0.01 0.01 1] )\ndefine robot position( size [0.3 0.3 1] )\n";
  for (int i = 0; i < 1000; i++) text += "wall( pose [" + std::to_string(i) + " 9 0 0] )\n";
  for (int i = 0; i < 250; i++) text += "robot( pose [" + std::to_string(i) + " 0 0 0] )\n";
  const ScenePointer scene = SceneOf(text, 0);
  ASSERT_TRUE(scene);
  EXPECT_NE(Stg::rows::WhyNotOnDevice(scene).find("250 movers"), std::string::npos)
      << Stg::rows::WhyNotOnDevice(scene);
  EXPECT_EQ(Stg::rows::WhyNotOnDevice(SceneOf("position( size [0.3 0.3 0.3] )", 0)), "");
}

/// A device with an error in one bit of a column.
class WrongDevice : public Stg::test::HostRowDevice {
 public:
  explicit WrongDevice(int column) : column_(column) {}
  void Step(uint32_t steps, uint32_t unseen) override {
    HostRowDevice::Step(steps, unseen);
    uint8_t byte = 0;
    Read(offset(), &byte, 1);
    byte ^= 1;
    Write(offset(), &byte, 1);
  }
  void Begin(std::span<const uint64_t> image, const Stg::rows::RowBuffers& buffers) override {
    HostRowDevice::Begin(image, buffers);
    offset_ = reinterpret_cast<const Stg::row_scene_t*>(image.data())->columns[column_];
  }

 private:
  size_t offset() const { return offset_; }

  const int column_;
  size_t offset_ = 0;
};

TEST(DeviceSelfTestTest, FindsAnErrorOfOneBitInAColumn) {
  Stg::InitLibrary();
  Stg::test::HostRowDevice right;
  EXPECT_EQ(Stg::rows::SelfTest(&right), "");
  for (const int column :
       {Stg::ROW_POSE, Stg::ROW_DRIVEN, Stg::ROW_NOISE, Stg::ROW_RANDOM, Stg::ROW_MEMORY}) {
    WrongDevice wrong(column);
    EXPECT_NE(Stg::rows::SelfTest(&wrong), "") << column;
  }
}

TEST(DeviceSelfTestTest, RefusesADeviceWithOtherKernelsByName) {
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  std::string message;
  const auto right = Stg::rows::OpenRowDevice("", kChosen, &message);
  ASSERT_TRUE(right) << message;
  // The next number after pi; other options of compilers have no effect on some devices.
  setenv("STAGE_CL_OPTIONS", "-DROW_PI=3.1415926535897936", 1);
  const auto wrong = Stg::rows::OpenRowDevice("", kChosen, &message);
  unsetenv("STAGE_CL_OPTIONS");
  EXPECT_FALSE(wrong);
  EXPECT_NE(message.find("results differ"), std::string::npos) << message;
  EXPECT_NE(message.find(right->Name()), std::string::npos) << message;
}

}  // namespace
