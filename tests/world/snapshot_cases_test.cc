// SPDX-License-Identifier: GPL-2.0-or-later
//
// A snapshot of any state can be restored by the world itself, by a fresh world, by one with
// another history, and by a copy; full and lean; from memory and from bytes. A snapshot taken
// afterwards is equal, and the worlds have the same future.
//
// The cases are the product of ray models, energy, changes of the world, and kinds of snapshots.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "messages/report.hh"
#include "stage.hh"
#include "support/meddler.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"
#include "world/ray_caster.hh"

namespace Stg {
namespace {

/// The properties of a world in the product.
struct Kind {
  bool exact;   ///< use the exact ray model
  bool energy;  ///< robots have power packs
  bool far;     ///< the first model is outside of the grid's coordinates
};

/// Two robots with a device of each type. The gripper of the first robot can reach the puck.
std::string TextOf(const Kind& kind) {
  std::ostringstream text;
  if (kind.exact) text << "ray_model \"exact\"\n";
  if (kind.far) text << "model( name \"far\" pose [2000000000000 0 0 0] )\n";
  text << "resolution 0.02\n"
          "define robot position( size [0.4 0.4 0.3] alwayson 1 fiducial_return 1 "
       << (kind.energy ? "joules 1000" : "")
       << "\n"
          "  ranger( alwayson 1 sensor( range [0 6] fov 180 samples 19 noise [0.01 0.01 0] ) )\n"
          "  blobfinder( alwayson 1 image [20 10] )\n"
          "  fiducial( alwayson 1 range_max 6 )\n"
          "  bumper( alwayson 1 bcount 1 bpose[0] [0.2 0 0 0] blength 0.4 )\n"
          "  camera( alwayson 1 resolution [8 6] )\n"
          "  gripper( pose [0.25 0 -0.3 0] alwayson 1 )\n"
          "  actuator( alwayson 1 size [0.1 0.1 0.1] max_speed 1 )\n"
          "  wifi( alwayson 1 model \"simple\" range 5 )\n"
          "  light() lightsensor( alwayson 1 noise [0.1 0.1] )\n"
          "  lightindicator() )\n"
          "robot( name \"a\" pose [-2 0 0 0] )\n"
          "robot( name \"b\" pose [0 0.4 0 180] fiducial_return 2 )\n"
          "model( name \"wall\" pose [0 3 0 0] size [8 0.2 1] )\n"
          "model( name \"zone\" pose [0 0 0 0] size [2 2 0.01] obstacle_return 0 )\n"
          "model( name \"puck\" pose [-1.73 0 0 0] size [0.1 0.1 0.2] gripper_return 1\n"
          "  obstacle_return 0 model( name \"lid\" size [0.05 0.05 0.05] ) )\n"
          "blinkenlight( name \"blinken\" intensity 1 pose [1 1 0 0] size [0.1 0.1 0.1] )\n"
          "position( name \"drone\" pose [2 -2 1 0] size [0.2 0.2 0.1] alwayson 1\n"
          "  ranger( alwayson 1 sensor( range [0 3] fov 90 samples 5 ) ) )\n";
  return text.str();
}

struct Action {
  std::string name;
  std::function<void(World*)> take;
};

void Grip(World* world) {
  static_cast<ModelGripper*>(world->GetModel("a.gripper:0"))->CommandClose();
  Step(*world, 25);
  EXPECT_NE(static_cast<ModelGripper*>(world->GetModel("a.gripper:0"))->GetConfig().gripped,
            nullptr);
}

void GripAndRelease(World* world) {
  Grip(world);
  static_cast<ModelGripper*>(world->GetModel("a.gripper:0"))->CommandOpen();
  Step(*world, 25);
}

void LookExactly(World* world) {
  double range = 0;
  const Pose pose(1, 2, 0, 0);
  CastOptions options;
  options.ray_model = RayModel::kExact;
  EXPECT_TRUE(RayCaster(world, options).Cast(&pose, 1, {0.0}, 9, &range));
}

std::vector<Action> AllActions() {
  std::vector<Action> actions = {{"nothing", [](World*) {}}};
  for (const std::string name :
       {"a", "b", "a.ranger:0", "a.blobfinder:0", "a.fiducial:0", "a.bumper:0", "a.camera:0",
        "a.gripper:0", "a.actuator:0", "a.wifi:0", "a.lightindicator:0", "wall", "zone", "puck",
        "puck.lid", "blinken", "drone", "drone.ranger:0"})
    actions.push_back({"delete " + name, [=](World* world) { delete world->GetModel(name); }});
  for (const std::string name : {"a", "a.gripper:0", "puck", "b"})
    actions.push_back({"grip, delete " + name, [=](World* world) {
                         Grip(world);
                         delete world->GetModel(name);
                       }});
  actions.push_back({"grip", Grip});
  actions.push_back({"grip and release", GripAndRelease});
  actions.push_back({"grip and release, delete puck", [](World* world) {
                       GripAndRelease(world);
                       delete world->GetModel("puck");
                     }});
  actions.push_back({"create", [](World* world) {
                       world->CreateModel(nullptr, "position")->SetPose(Pose(1, -1, 0, 0));
                     }});
  actions.push_back({"create, delete wall", [](World* world) {
                       world->CreateModel(nullptr, "position")->SetPose(Pose(1, -1, 0, 0));
                       delete world->GetModel("wall");
                     }});
  actions.push_back(
      {"reparent", [](World* world) { world->GetModel("b")->SetParent(world->GetModel("wall")); }});
  actions.push_back(
      {"teleport", [](World* world) { world->GetModel("b")->SetPose(Pose(30, 30, 0, 1)); }});
  actions.push_back({"teleport beyond all cells",
                     [](World* world) { world->GetModel("b")->SetPose(Pose(2e12, 30, 0, 1)); }});
  actions.push_back({"create beyond all cells, delete puck", [](World* world) {
                       world->CreateModel(nullptr, "model")->SetPose(Pose(2e12, 30, 0, 1));
                       delete world->GetModel("puck");
                     }});
  actions.push_back({"resize", [](World* world) {
                       world->GetModel("wall")->SetGeom(Geom(Pose(), Size(3, 1, 1)));
                     }});
  actions.push_back(
      {"add a block", [](World* world) { world->GetModel("wall")->AddBlockRect(0, 0, 1, 1, 1); }});
  actions.push_back({"look with exact rays", LookExactly});
  actions.push_back({"add a block, look with exact rays", [](World* world) {
                       world->GetModel("wall")->AddBlockRect(0, 0, 1, 1, 1);
                       LookExactly(world);
                     }});
  return actions;
}

std::unique_ptr<World> Load(const std::string& text, uint64_t seed) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "cases.world"));
  return world;
}

Snapshot FromBytes(const Snapshot& snapshot) {
  std::stringstream bytes;
  Snapshot read;
  EXPECT_TRUE(snapshot.Write(bytes) && read.Read(bytes));
  return read;
}

struct Case {
  Kind kind;
  Action action;
  int steps_after;
  Snapshot::Keep keep;

  std::string Name() const {
    return std::string(kind.exact ? "exact rays, " : "cells, ") + (kind.energy ? "energy, " : "") +
           (kind.far ? "far model, " : "") + action.name + ", " + std::to_string(steps_after) +
           " steps later, " + (keep == Snapshot::kFull ? "full" : "lean");
  }
};

std::vector<Case> AllCases() {
  std::vector<Case> cases;
  for (const bool exact : {false, true})
    for (const auto& [energy, far] : {std::pair(false, false), {true, false}, {false, true}})
      for (const Action& action : AllActions())
        for (const int steps : {0, 3})
          for (const Snapshot::Keep keep : {Snapshot::kFull, Snapshot::kLean})
            cases.push_back({{exact, energy, far}, action, steps, keep});
  return cases;
}

/// Restores the snapshot and checks the world. Returns the first error; empty: none.
std::string WrongWith(World* world, const Snapshot& from, uint64_t hash, uint64_t later,
                      Snapshot::Keep keep) {
  messages::Collector complaints;
  if (!world->Restore(from))
    return "refused: " + (complaints.lines.empty() ? "" : complaints.lines.back());
  if (const std::string fault = world->Validate(); !fault.empty()) return fault;
  if (keep == Snapshot::kFull && world->StateHash() != hash) return "another state hash";
  Snapshot again;
  if (!world->Take(&again, keep)) return "can't be taken again";
  if (again.hash() != from.hash()) return "another snapshot";
  Step(*world, 5);
  if (world->StateHash() != later) return "another future";
  return world->Validate();
}

/// Brings a world into the state of the case, and compares all ways of restoring it.
void Check(const Case& c) {
  const std::string text = TextOf(c.kind);
  const std::unique_ptr<World> world = Load(text, 1);
  Step(*world, 3);
  c.action.take(world.get());
  EXPECT_EQ(world->Validate(), "");
  Step(*world, c.steps_after);
  EXPECT_EQ(world->Validate(), "");
  Snapshot snapshot;
  ASSERT_TRUE(world->Take(&snapshot, c.keep));
  const uint64_t hash = world->StateHash();
  Step(*world, 5);
  const uint64_t later = world->StateHash();
  const Snapshot read = FromBytes(snapshot);
  const std::unique_ptr<World> fresh = Load(text, 2), other = Load(text, 2);
  const auto copy = std::make_unique<World>(OptionsOf(3));
  ASSERT_TRUE(copy->LoadCopy(*world));
  Go(other.get(), 5, 0, 5);
  const std::vector<std::pair<std::string, World*>> places = {{"in place", world.get()},
                                                              {"in a fresh world", fresh.get()},
                                                              {"with another past", other.get()},
                                                              {"in a copy", copy.get()}};
  for (const auto& [name, place] : places) {
    EXPECT_EQ(WrongWith(place, snapshot, hash, later, c.keep), "") << name;
    EXPECT_EQ(WrongWith(place, read, hash, later, c.keep), "") << name << ", from bytes";
  }
}

TEST(SnapshotCases, EachStateCanBeRestored) {
  Init(nullptr, nullptr);
  SetLogSink([](LogLevel, const std::string&) {});
  for (const Case& c : AllCases()) {
    SCOPED_TRACE(c.Name());
    Check(c);
  }
  SetLogSink(nullptr);
}

}  // namespace
}  // namespace Stg
