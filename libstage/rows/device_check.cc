// SPDX-License-Identifier: GPL-2.0-or-later
//
// The self-test of devices: random drives of some scenes on host and device.

#include <algorithm>
#include <array>
#include <cstring>
#include <numeric>
#include <span>
#include <sstream>
#include <utility>
#include <vector>

#include "messages/assert.hh"
#include "models/position.hh"
#include "rows/device_columns.hh"
#include "rows/device_rows.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg::rows {

namespace {

constexpr size_t kWorlds = 23;
constexpr uint32_t kRounds = 20;

/// Robots of all drives with noise, odometry, packs and rays of both models, among walls.
constexpr char kRobots[] = R"(
define wheeled sized(
  drive "diff" localization "odom" odom_noise [0.02 0.01 0.03 0.02] wheel_slip 0.3
  joules 4 joules_capacity 200
  block( points 6 point[0] [0.75 0] point[1] [1 0.25] point[2] [1 0.75] point[3] [0.75 1]
         point[4] [0 1] point[5] [0 0] z [0 1] )
  ranger( pose [0.05 0 -0.1 10] sensor( range [0.1 1.5] fov 240 samples 24 noise [0.01 0.02 0.5]
    blind_near 1 loss 0.1 range_step 0.01 steepest 60 ) )
)
define omni sized(
  drive "omni" localization "gps" round 1 acceleration_bounds [-1 1 -1 1 0 0 -90 90]
  ranger( pose [0 0 -0.1 0] sensor( range [0 3] fov 360 samples 32 ) )
)
define car sized(
  drive "car" origin [0.05 0 0 0] ranger_return 0.5
  ranger( pose [0 0 -0.1 0] sensor( range [0 2] fov 90 samples 16 ray_model "exact" ) )
)
model( pose [0 1.2 0 3] size [2.4 0.05 1] )
model( pose [0 -1.2 0 0] size [2.4 0.05 0.15] ranger_return 2 )
model( pose [1.2 0 0 0] size [0.05 2.4 1] )
model( pose [-1.2 0 0 -5] size [0.05 2.4 1] ranger_return -1 )
wheeled( pose [-0.5 -0.5 0 30] )
omni( pose [0.5 -0.5 0 100] )
car( pose [0.5 0.5 0 -70] )
omni( pose [-0.5 0.5 0 -160] )
)";

/// Robots with all built-in controllers.
constexpr char kControlled[] = R"(
wheeled( pose [-0.9 0 0 0] ctrl "stage/wander" )
omni( pose [0.9 0 0 0] ctrl "stage/pedestrian goals=-0.8,0.1,0.7,0.7 loop=1 group=3 member=2" )
omni( pose [0 -0.9 0 0] ctrl "stage/disperse" )
wheeled( pose [0 0.9 0 0] ctrl "stage/goal x=0.5 y=-0.5" )
omni( pose [0.9 -0.9 0 0] ctrl "stage/orca goals=0.4,-0.3,-0.9,0.8 near=0.6" )
omni( pose [-0.9 0.9 0 0] ctrl "stage/behaviour kind=4 x=0.8 y=-0.9" )
wheeled( pose [-0.9 -0.9 0 0] ctrl "stage/behaviour kind=3 x=0.8 y=0.8" )
)";

/// Things to push.
constexpr char kCrates[] = R"(
define crate model( size [0.16 0.12 0.3] pushable 1 mass 0.5 friction 0.3 )
crate( pose [0 0 0 20] )
crate( pose [0 0.3 0 0] round 1 )
crate( pose [-0.1 -0.2 0 50] )
)";

/// A scene of the self-test.
struct SceneKind {
  std::string size;  ///< of the robots, m; small ones have room for others with controllers
  bool controlled, outlines;
  uint32_t work_items;  ///< of a world; 0: the device's choice
  bool varies;          ///< properties differ between worlds
};

/// Numbers that differ between worlds, of those that scenes can vary.
std::vector<VariedNumber> NumbersToVary(const World& world) {
  constexpr VariedProperty kProperties[] = {
      VariedProperty::kMass,           VariedProperty::kFriction,
      VariedProperty::kWheelSlip,      VariedProperty::kOdomNoise,
      VariedProperty::kVelocityBounds, VariedProperty::kAccelerationBounds,
      VariedProperty::kWheelbase,      VariedProperty::kSteeringLimit,
      VariedProperty::kNoise};
  std::vector<VariedNumber> numbers;
  for (const Model* model : world.engine().models)
    for (const VariedProperty property : kProperties)
      for (const uint32_t element : {0u, 1u, 2u, 7u})
        if (const VariedNumber number{model->GetId(), 0, property, element};
            RowBridge::CanVary(world, number))
          numbers.push_back(number);
  return numbers;
}

/// Values of them for a world. Some noise is 0.
std::vector<double> ValuesOf(const Scene& scene, RandomStream* random) {
  std::vector<double> values;
  for (const Varied& varied : scene.varied) {
    const VariedProperty property = varied.number.property;
    const bool is_bound = property == VariedProperty::kVelocityBounds ||
                          property == VariedProperty::kAccelerationBounds;
    const bool is_noise =
        property == VariedProperty::kNoise || property == VariedProperty::kOdomNoise;
    const double size = random->Uniform(0.1, is_noise ? 0.11 : 1);
    values.push_back(is_noise && random->Choose(2)                ? 0
                     : is_bound && varied.number.element % 2 == 0 ? -size
                                                                  : size);
  }
  return values;
}

std::shared_ptr<const Scene> MakeScene(const SceneKind& kind) {
  std::ostringstream text;
  text << "resolution 0.02\ncontacts \"" << (kind.outlines ? "outlines" : "cells")
       << "\"\ndefine sized position( size [" << kind.size << " " << kind.size
       << " 0.3] friction 0.2 )\n"
       << kRobots << (kind.controlled ? kControlled : "") << (kind.outlines ? kCrates : "");
  RunOptions options;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<World>(options);
  std::istringstream content(text.str());
  if (!world->Load(content, "self-test")) return nullptr;
  for (Model* model : world->GetChildren()) {
    if (!dynamic_cast<ModelPosition*>(model)) continue;
    model->Subscribe();
    for (Model* child : model->GetChildren()) child->Subscribe();
  }
  std::vector<VariedNumber> varied;
  if (kind.varies) varied = NumbersToVary(*world);
  std::string reason;
  return RowBridge::MakeScene(std::move(world), &reason, varied);
}

void Command(RandomStream* random, Rows* rows) {
  for (size_t i = 0; i < rows->columns.command.size(); i++) {
    const bool car = rows->scene().movers[i % rows->scene().movers.size()].steers;
    rows->columns.command[i] = {random->Uniform(-1, 1), random->Uniform(-1, 1),
                                random->Uniform(-2, 2)};
    rows->columns.mode[i] = car ? uint8_t{DriveInput::kVelocity}
                                : static_cast<uint8_t>(random->Choose(DriveInput::kPosition + 1));
  }
}

std::vector<std::byte> BytesOf(const Rows& rows) {
  std::vector<std::byte> bytes;
  ForEachDeviceColumn(&rows.columns, [&](int, const auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    const size_t end = bytes.size();
    bytes.resize(end + column->size() * kSizeOnDevice<T>);
    ToDevice(column->data(), column->size(), bytes.data() + end);
  });
  return bytes;
}

/// True if some robots are hindered, and things are being pushed.
bool IsCrowded(const Rows& rows) {
  const Columns& c = rows.columns;
  bool pushes = false;
  for (size_t i = 0; i < c.before.size(); i++)
    pushes |= rows.scene().movers[i % rows.scene().movers.size()].is_pushed &&
              !(c.before[i] == c.pose[i]);
  return pushes && std::ranges::count(c.hindered, 1) > 0;
}

/// True if robots have moved and stall, some of them have run out of energy, and rays hit things.
[[maybe_unused]] bool IsVaried(const Rows& rows) {
  const Columns& c = rows.columns;
  const auto count = [](const auto& column, auto value) {
    return static_cast<size_t>(std::ranges::count(column, value));
  };
  return count(c.stamp, uint64_t{0}) < c.stamp.size() / 2 && count(c.stalled, 1) > 0 &&
         count(c.stored, 0.0) > 0 && count(c.brightness, 0) < c.brightness.size() / 4 * 3 &&
         (!rows.scene().outlines || IsCrowded(rows));
}

std::string SelfTestWith(RowDevice* device, const SceneKind& kind) {
  const std::shared_ptr<const Scene> scene = MakeScene(kind);
  if (!scene || !WhyNotOnDevice(scene).empty()) return "the scene of the self-test has an error";
  std::array<uint64_t, kWorlds> seeds;
  std::iota(seeds.begin(), seeds.end(), uint64_t{1});
  Rows host(scene, seeds), read(scene, seeds);
  const std::shared_ptr<RowDevice> borrowed(std::shared_ptr<RowDevice>(), device);  // never deleted
  DeviceRows rows(scene, kWorlds, borrowed, kind.work_items);
  const auto scratch = host.MakeScratch();
  RandomStream random(7);
  for (size_t i = 0; i < kWorlds; i++) host.Reset(i, seeds[i], ValuesOf(*scene, &random));
  rows.Write(host);
  for (uint32_t round = 0; round < kRounds; round++) {
    Command(&random, &host);
    rows.Write(host, 1u << ROW_COMMAND | 1u << ROW_MODE);
    const uint32_t steps = 1 + round % 4;
    for (size_t i = 0; i < kWorlds; i++) host.Step(i, steps, scratch.get());
    rows.Step(steps);
    if (round % 7 != 6) continue;
    const std::array<uint32_t, 2> reset = {round % uint32_t{kWorlds}, kWorlds - 1};
    const std::array<uint64_t, 2> new_seeds = {random.Next(), random.Next()};
    const std::array<std::vector<double>, 2> values = {ValuesOf(*scene, &random),
                                                       ValuesOf(*scene, &random)};
    const std::array<std::span<const double>, 2> given = {values[0], values[1]};
    for (size_t i = 0; i < 2; i++) host.Reset(reset[i], new_seeds[i], given[i]);
    rows.Reset(reset, new_seeds, given);
  }
  STAGE_ASSERT(IsVaried(host));
  rows.Read(&read);
  return BytesOf(host) == BytesOf(read) ? "" : "its results differ from those of the host";
}

}  // namespace

// A device chooses how many worlds share a work-group; both cases are tested.
std::string SelfTest(RowDevice* device) try {
  for (const SceneKind& kind : {SceneKind{"0.2", true, false, 0, false},
                                {"0.45", false, false, 8, false},
                                {"0.25", true, true, 8, false},
                                {"0.25", false, true, 0, true}})
    if (std::string wrong = SelfTestWith(device, kind); !wrong.empty()) return wrong;
  return "";
} catch (const RowDeviceError& error) {
  return error.what();
}

}  // namespace Stg::rows
