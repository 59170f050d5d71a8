// SPDX-License-Identifier: GPL-2.0-or-later
//
// Contacts of outlines in worlds: what models do, for all that tests/motion does not see. The
// geometry and the forces of contacts are tested there.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

constexpr double kSkin = 4e-4;  // m: the distance of outlines in contact

/// A world with contacts of outlines.
std::unique_ptr<World> LoadOutlines(const std::string& text, const std::string& head = "") {
  return LoadText("contacts \"outlines\"\n" + head + text);
}

std::string Robot(const std::string& name, const std::string& properties) {
  return "position( name \"" + name + "\" alwayson 1 " + properties + " )\n";
}

/// A wall along the y axis whose face is at x.
std::string WallAt(double x) {
  return "model( name \"wall\" pose [" + std::to_string(x + 0.5) + " 0 0 0] size [1 20 1] )\n";
}

constexpr char kDisc[] = "round 1 size [0.4 0.4 0.4] ";
constexpr char kSquare[] = "size [0.4 0.4 0.4] ";

std::vector<ContactPoint> ContactsOf(const World& world) {
  std::vector<ContactPoint> all;
  world.ForEachContact([&](const ContactPoint& contact) { all.push_back(contact); });
  return all;
}

// ---- walls --------------------------------------------------------------------------------------

TEST(Outlines, StopARobotAtAWallWhateverItsSpeedHeadingAndTheCells) {
  for (const char* resolution : {"0.01", "0.05", "0.1"})
    for (const char* speed : {"0.02", "0.6", "1.5"})
      for (int heading = -60; heading <= 60; heading += 15)
        for (const char* shape : {kDisc, kSquare}) {
          const std::string text =
              WallAt(1) +
              Robot("r", std::string(shape) + "pose [0.6 0 0 " + std::to_string(heading) + "] " +
                             "velocity_bounds [-2 2 -1 1 -1 1 -90 90]");
          const auto world = LoadOutlines(text, "resolution " + std::string(resolution) + "\n");
          auto* robot = Find<ModelPosition>(*world, "r");
          robot->SetSpeed(std::stod(speed), 0, 0);
          Step(*world, std::string(speed) == "0.02" ? 500 : 60);
          const std::vector<ContactPoint> contacts = ContactsOf(*world);
          ASSERT_FALSE(contacts.empty()) << resolution << " " << speed << " " << heading << shape;
          EXPECT_NEAR(contacts[0].gap, kSkin, 1e-6) << speed << " " << heading << shape;
          EXPECT_EQ(contacts[0].a, robot);
          EXPECT_EQ(contacts[0].b, Find<>(*world, "wall"));
          EXPECT_NEAR(contacts[0].normal.x, 1, 1e-9);
          EXPECT_NEAR(contacts[0].point.x, 1 - kSkin / 2, 1e-6);
          // A square may turn along the wall, so that it drives freely.
          EXPECT_TRUE(robot->Stalled() || shape == kSquare);
        }
}

TEST(Outlines, LetARobotSlideAlongAWall) {
  const auto world =
      LoadOutlines(WallAt(1) + Robot("r", std::string(kDisc) + "pose [0.7 -5 0 60] "));
  auto* robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 50);
  const double y = robot->GetPose().y;
  Step(*world, 100);
  EXPECT_NEAR((robot->GetPose().y - y) / 10, 0.5 * std::sin(M_PI / 3), 0.0043);
  EXPECT_TRUE(robot->Stalled());  // half of the commanded motion is not made
  const Velocity made = robot->GetActualVelocity();
  EXPECT_NEAR(made.x, 0.5 * 0.75, 0.004);
  EXPECT_NEAR(made.y, 0.5 * std::sin(M_PI / 3) / 2, 0.004);
}

TEST(Outlines, LetARoundRobotTurnAtAWall) {
  for (int heading = 0; heading < 360; heading += 5) {
    const auto world =
        LoadOutlines(WallAt(1) + Robot("r", std::string(kDisc) + "pose [0.79961 0 0 " +
                                                std::to_string(heading) + "]"));
    auto* robot = Find<ModelPosition>(*world, "r");
    robot->SetSpeed(0, 0, 1);
    Step(*world, 10);
    EXPECT_NEAR(normalize(robot->GetPose().a - heading * M_PI / 180), 1, 1e-9) << heading;
    EXPECT_FALSE(robot->Stalled());
  }
}

TEST(Outlines, AreAsExactFarFromTheOrigin) {
  for (const double x : {-2e7, 1e5, 2e7})
    for (const char* shape : {kDisc, kSquare}) {
      char text[300];
      std::snprintf(text, sizeof text,
                    "model( name \"wall\" pose [%.0f 0 0 0] size [1 20 1] )\n"
                    "model( name \"other\" pose [0 0 0 0] size [1 20 1] )\n",
                    x + 2);
      char pose[100];
      std::snprintf(pose, sizeof pose, "pose [%.0f 0 0 10] ", x);
      const auto world =
          LoadOutlines(text + Robot("r", std::string(shape) + pose), "resolution 0.1\n");
      Find<ModelPosition>(*world, "r")->SetSpeed(0.5, 0, 0);
      Step(*world, 60);
      ASSERT_FALSE(ContactsOf(*world).empty()) << x << shape;
      EXPECT_NEAR(ContactsOf(*world)[0].gap, kSkin, 1e-6) << x << shape;
    }
}

// ---- pushing ------------------------------------------------------------------------------------

TEST(Outlines, LetARobotPushABox) {
  const auto world =
      LoadOutlines(Robot("r", std::string(kDisc) + "mass 10 pose [0 0 0 0]") +
                   "model( name \"box\" pose [0.6 0 0 0] size [0.4 0.4 0.4] mass 5 pushable 1 )\n");
  auto* robot = Find<ModelPosition>(*world, "r");
  Model* box = Find<>(*world, "box");
  robot->SetSpeed(0.2, 0, 0);
  Step(*world, 100);
  EXPECT_NEAR(robot->GetPose().x, 2, 0.004);
  EXPECT_NEAR(box->GetPose().x - robot->GetPose().x, 0.4 + kSkin, 1e-5);
  EXPECT_FALSE(robot->Stalled());
  robot->Stop();
  const Pose before = box->GetPose();
  Step(*world, 10);
  EXPECT_TRUE(box->GetPose() == before);
}

TEST(Outlines, DoNotLetARobotPushWhatIsTooHeavyOrNotPushable) {
  for (const char* properties :
       {"mass 50 pushable 1", "mass 1", "mass 10 floor_friction 0.9 pushable 1"}) {
    const auto world = LoadOutlines(Robot("r", std::string(kDisc) + "mass 10 pose [0 0 0 0]") +
                                    "model( name \"box\" pose [0.6 0 0 0] size [0.4 0.4 0.4] " +
                                    properties + " )\n");
    auto* robot = Find<ModelPosition>(*world, "r");
    robot->SetSpeed(0.2, 0, 0);
    Step(*world, 100);
    EXPECT_NEAR(Find<>(*world, "box")->GetPose().x, 0.6, 1e-6) << properties;
    EXPECT_NEAR(robot->GetPose().x, 0.2 - kSkin, 1e-5) << properties;
    EXPECT_TRUE(robot->Stalled());
  }
}

// ---- crowds -------------------------------------------------------------------------------------

/// A closed room of 6 m with robots of several shapes and things to push, all driving at random.
std::string Crowd(uint64_t seed, int robots, int boxes, const char* resolution = "0.05") {
  RandomStream random(seed);
  std::string text = "resolution " + std::string(resolution) + "\n";
  for (const char* wall :
       {"pose [0 3.1 0 0] size [6.4 0.2 1]", "pose [0 -3.1 0 0] size [6.4 0.2 1]",
        "pose [3.1 0 0 0] size [0.2 6 1]", "pose [-3.1 0 0 0] size [0.2 6 1]"})
    text += "model( " + std::string(wall) + " )\n";
  const char* shapes[] = {
      "round 1 size [0.3 0.3 0.3]", "size [0.3 0.2 0.3]", "size [0.4 0.4 0.4] drive \"omni\"",
      "size [0.35 0.35 0.3] block( points 6 point[0] [0 0] point[1] [3 0] point[2] [3 1] "
      "point[3] [1 1] point[4] [1 3] point[5] [0 3] z [0 1] )"};
  const int side = static_cast<int>(std::ceil(std::sqrt(robots + boxes)));
  for (int i = 0; i < robots + boxes; i++) {
    char pose[100];
    std::snprintf(pose, sizeof pose, "pose [%.3f %.3f 0 %.1f] ",
                  (i % side - (side - 1) / 2.0) * 5.6 / side,
                  (i / side - (side - 1) / 2.0) * 5.6 / side, random.Uniform(-180, 180));
    if (i < robots)
      text += Robot("r" + std::to_string(i), std::string(pose) + shapes[i % 4] +
                                                 (i % 5 == 4 ? " pushable 1" : "") +
                                                 " friction 0.2 mass 5");
    else
      text += "model( name \"box" + std::to_string(i) + "\" " + pose +
              (i % 2 ? "round 1 size [0.3 0.3 0.3]" : "size [0.3 0.3 0.3]") +
              " mass 1 friction 0.3 pushable 1 )\n";
  }
  return text;
}

/// Changes the commands of all robots every second.
void Drive(World* world, RandomStream* random, int steps) {
  for (int i = 0; i < steps; i++) {
    if (world->GetUpdateCount() % 10 == 0)
      for (Model* model : world->host().models)  // in the order of creation
        if (auto* robot = dynamic_cast<ModelPosition*>(model))
          robot->SetSpeed(random->Uniform(-0.2, 0.8), random->Uniform(-0.5, 0.5),
                          random->Uniform(-1.5, 1.5));
    Step(*world);
  }
}

double LeastGap(const World& world) {
  double least = 1;
  for (const ContactPoint& contact : ContactsOf(world)) least = std::min(least, contact.gap);
  return least;
}

TEST(Outlines, NeverOverlapInRandomCrowds) {
  size_t contacts = 0;
  for (uint64_t seed = 1; seed <= 6; seed++) {
    const auto world = LoadOutlines(Crowd(seed, 60, 20));
    RandomStream random(seed);
    for (int i = 0; i < 100; i++) {
      Drive(world.get(), &random, 1);
      contacts += ContactsOf(*world).size();
      ASSERT_GE(LeastGap(*world), 2e-5 - 1e-9) << seed << " step " << i;
    }
    for (const Model* model : world->GetAllModels()) {
      EXPECT_LT(std::fabs(model->GetGlobalPose().x), 3.2);
      EXPECT_LT(std::fabs(model->GetGlobalPose().y), 3.2);
    }
  }
  EXPECT_GT(contacts, 5000u);
}

TEST(Outlines, GiveEqualResultsWithAnyNumberOfThreads) {
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2, 5}) {
    RunOptions options;
    options.threads = threads;
    options.share_from = 1;
    options.contacts = ContactModel::kOutlines;
    InitLibrary();
    World world(options);
    std::istringstream text(Crowd(7, 60, 20));
    ASSERT_TRUE(world.Load(text, "t.world"));
    RandomStream random(7);
    Drive(&world, &random, 60);
    hashes.push_back(world.StateHash());
    EXPECT_EQ(threads > 1, world.engine().shared_jobs() > 0);
  }
  EXPECT_EQ(hashes[1], hashes[0]);
  EXPECT_EQ(hashes[2], hashes[0]);
}

TEST(Outlines, GoOnTheSameAfterASnapshotInTheMiddleOfContacts) {
  const auto world = LoadOutlines(Crowd(3, 60, 20));
  RandomStream random(3);
  Drive(world.get(), &random, 40);
  Snapshot snapshot;
  world->Take(&snapshot);
  const RandomStream after = random;
  std::vector<uint64_t> hashes;
  for (int run = 0; run < 3; run++) {
    RandomStream again = after;
    Drive(world.get(), &again, 30);
    hashes.push_back(world->StateHash());
    ASSERT_TRUE(world->Restore(snapshot));
  }
  EXPECT_EQ(hashes[1], hashes[0]);
  EXPECT_EQ(hashes[2], hashes[0]);
  const auto other = LoadOutlines(Crowd(3, 60, 20));
  ASSERT_TRUE(other->Restore(snapshot));
  RandomStream again = after;
  Drive(other.get(), &again, 30);
  EXPECT_EQ(other->StateHash(), hashes[0]);
}

TEST(Outlines, GiveTheResultsOfCellsUntilSomethingTouches) {
  int compared = 0;
  for (uint64_t seed = 1; seed <= 20; seed++) {
    const std::string text = Crowd(seed, 16, 4);
    const auto cells = LoadText("contacts \"cells\"\n" + text);
    const auto outlines = LoadOutlines(text);
    RandomStream of_cells(seed), of_outlines(seed);
    const auto any_stalled = [&] {
      return std::ranges::any_of(cells->GetAllModels(), [](Model* m) { return m->Stalled(); });
    };
    while (cells->GetUpdateCount() < 200) {
      Drive(cells.get(), &of_cells, 1);
      Drive(outlines.get(), &of_outlines, 1);
      if (any_stalled()) break;  // cells stop bodies before they touch
      ASSERT_EQ(cells->StateHash(), outlines->StateHash()) << seed;
      compared++;
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(Outlines, StopWhatIsFasterThanAThinWallIsThick) {
  for (int i = 0; i < 40; i++) {
    const auto world = LoadOutlines(
        "model( name \"wall\" pose [1 0 0 " + std::to_string(i) + "] size [0.001 2000 1] )\n" +
        Robot("r", "round 1 size [0.1 0.1 0.1] velocity_bounds [-100 100 -1 1 -1 1 -90 90] pose [" +
                       std::to_string(-0.03 * i) + " 0 0 0]"));
    auto* robot = Find<ModelPosition>(*world, "r");
    robot->SetSpeed(i < 20 ? 1.5 : 60, 0, 0);
    Step(*world, 30);
    const double cosine = std::cos(i * M_PI / 180), sine = std::sin(i * M_PI / 180);
    const Pose pose = robot->GetPose();
    EXPECT_LT((pose.x - 1) * cosine + pose.y * sine, -0.05) << i;
  }
}

TEST(Outlines, OdometryFollowsTheMotionThatWasMade) {
  const std::string odometry =
      "localization \"odom\" localization_origin [0 0 0 0] odom_error [0 0 0 0] ";
  const auto world =
      LoadOutlines(WallAt(1) + Robot("r", kSquare + odometry + "pose [0 0 0 35]") +
                   Robot("pushed", kDisc + odometry + "pose [-0.6 -0.42 0 0] pushable 1 mass 1"));
  auto* robot = Find<ModelPosition>(*world, "r");
  auto* pushed = Find<ModelPosition>(*world, "pushed");
  bool slid = false;
  for (int i = 0; i < 200; i++) {
    robot->SetSpeed(i < 40 ? -0.4 : 0.4, 0, i < 100 ? 0 : 0.3);
    Step(*world);
    slid |= robot->Stalled() && !robot->GetActualVelocity().IsZero();
  }
  EXPECT_TRUE(slid);
  EXPECT_GT(std::hypot(pushed->GetPose().x + 0.6, pushed->GetPose().y + 0.42), 0.01);
  for (const ModelPosition* each : {robot, pushed}) {
    // The estimate belongs to the poses before the last move.
    const Pose sensed = each->GetSensedPose();
    ExpectPose(each->est_pose, sensed.x, sensed.y, 0, sensed.a, 1e-9);
  }
}

// ---- changes of the world -----------------------------------------------------------------------

/// Drives for two seconds at 0.5 m/s from the origin and returns how far the robot came.
double Way(World* world) {
  auto* robot = Find<ModelPosition>(*world, "r");
  robot->SetPose(Pose(0, 0, 0, 0));
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 20);
  return robot->GetPose().x;
}

TEST(Outlines, FollowChangesOfTheWorld) {
  const auto world = LoadOutlines(WallAt(0.5) + Robot("r", kDisc) +
                                  Robot("other", std::string(kSquare) + "pose [0 5 0 0]"));
  Model* wall = Find<>(*world, "wall");
  const double blocked = 0.3 - kSkin;
  EXPECT_NEAR(Way(world.get()), blocked, 1e-6);
  wall->SetPose(Pose(1.2, 0, 0, 0));
  EXPECT_NEAR(Way(world.get()), blocked + 0.2, 1e-6);
  wall->SetGeom(Geom(Pose(), Size(0.4, 20, 1)));
  EXPECT_NEAR(Way(world.get()), blocked + 0.5, 1e-6);
  wall->SetObstacleReturn(false);
  EXPECT_NEAR(Way(world.get()), 1, 1e-9);
  wall->SetObstacleReturn(true);
  EXPECT_NEAR(Way(world.get()), blocked + 0.5, 1e-6);
  delete wall;
  EXPECT_NEAR(Way(world.get()), 1, 1e-9);
  Find<>(*world, "other")->SetPose(Pose(0.7, 0, 0, 0));  // a robot that stands
  EXPECT_NEAR(Way(world.get()), 0.3 - kSkin, 1e-6);
  Find<>(*world, "other")->SetPose(Pose(0.7, 0, 2, 0));  // high above
  EXPECT_NEAR(Way(world.get()), 1, 1e-9);
  world->SetContactModel(ContactModel::kCells);
  Find<>(*world, "other")->SetPose(Pose(0.7, 0, 0, 0));
  EXPECT_LT(Way(world.get()), 0.3);
  world->SetContactModel(ContactModel::kOutlines);
  EXPECT_NEAR(Way(world.get()), 0.3 - kSkin, 1e-6);
  auto* added = new Model(world.get(), nullptr, "model");
  added->SetGeom(Geom(Pose(), Size(0.2, 0.2, 1)));
  added->SetPose(Pose(0.4, 0, 0, 0));
  EXPECT_NEAR(Way(world.get()), 0.1 - kSkin, 1e-6);
  added->SetPushable(true);
  EXPECT_NEAR(Way(world.get()), 0.1 - kSkin, 1e-3);  // the other robot stops both
}

TEST(Outlines, CountChildrenAndTheirMoves) {
  // An arm in front of the robot touches first; it is drawn in later.
  const auto world = LoadOutlines(
      WallAt(1) +
      Robot("r", std::string(kDisc) +
                     "stack_children 0 actuator( name \"arm\" alwayson 1 pose [0.3 0 0 0] "
                     "size [0.4 0.05 0.1] axis [1 0 0] max_position 0.5 "
                     "min_position -0.3 )"));
  auto* arm = Find<ModelActuator>(*world, "r.arm");
  EXPECT_NEAR(Way(world.get()), 0.5 - kSkin, 1e-6);
  arm->SetSpeed(0.3);
  Step(*world, 20);  // there is a wall
  EXPECT_TRUE(arm->Stalled());
  EXPECT_NEAR(arm->GetPosition(), 0, 1e-9);
  arm->SetSpeed(-0.2);
  Step(*world, 10);
  EXPECT_FALSE(arm->Stalled());
  EXPECT_NEAR(arm->GetPosition(), -0.2, 1e-9);
  auto* robot = Find<ModelPosition>(*world, "r");
  EXPECT_NEAR(robot->GetPose().x, 0.7 - kSkin, 0.02);
  robot->Stop();
  Step(*world);
  arm->SetSpeed(0.3);
  Step(*world, 20);
  EXPECT_TRUE(arm->Stalled());
  EXPECT_GE(LeastGap(*world), 2e-5 - 1e-9);
}

TEST(Outlines, StopEachOfSeveralArmsThatMoveInTheSameStep) {
  const std::string arm =
      "actuator( alwayson 1 size [0.4 0.05 0.1] axis [1 0 0] max_position 1 pose ";
  const auto world = LoadOutlines(
      WallAt(1) + Robot("r", std::string(kDisc) + "stack_children 0 " + arm +
                                 "[0.1 0.1 0 0] name \"left\" )" + arm +
                                 "[0.3 -0.1 0 0] name \"right\" ) position( name \"rider\" "
                                 "alwayson 1 pose [0.3 0 0 0] size [0.1 0.05 0.1] )"));
  for (const char* name : {"r.left", "r.right"}) Find<ModelActuator>(*world, name)->SetSpeed(0.3);
  Find<ModelPosition>(*world, "r.rider")->SetSpeed(0.3, 0, 0);
  Step(*world, 40);
  for (const char* name : {"r.left", "r.right", "r.rider"}) {
    EXPECT_TRUE(Find<>(*world, name)->Stalled()) << name;
    EXPECT_LT(Find<>(*world, name)->GetGlobalPose().x, 1) << name;
  }
  EXPECT_GE(LeastGap(*world), 2e-5 - 1e-9);
}

TEST(Outlines, LetBodiesThatOverlapAtTheStartLeave) {
  const auto world = LoadOutlines(Robot("r", kSquare) +
                                  Robot("other", std::string(kSquare) + "pose [0.3 0.1 0 30]"));
  auto* robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(-0.5, 0, 0);
  Step(*world, 20);
  EXPECT_NEAR(robot->GetPose().x, -1, 0.05);
}

TEST(Outlines, DoNotMoveABodyBelowTheFloor) {
  const auto world = LoadOutlines(Robot("r", "pose [0 0 -0.01 0]"));
  auto* robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 3);
  ExpectPose(robot->GetPose(), 0, 0, -0.01, 0);
  EXPECT_TRUE(robot->Stalled());
}

// ---- what is told -------------------------------------------------------------------------------

TEST(Outlines, TellContactsToCallbacksOfTheRobotsThatTouch) {
  const auto world = LoadOutlines(WallAt(1) + Robot("r", kDisc) +
                                  Robot("far", std::string(kDisc) + "pose [-5 0 0 0]"));
  int calls = 0, far_calls = 0;
  const auto count = [](Model*, void* counter) {
    ++*static_cast<int*>(counter);
    return 0;
  };
  auto* robot = Find<ModelPosition>(*world, "r");
  robot->AddCallback(Model::CB_CONTACT, count, &calls);
  Find<>(*world, "far")->AddCallback(Model::CB_CONTACT, count, &far_calls);
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 15);
  EXPECT_EQ(calls, 0);
  Step(*world, 5);
  EXPECT_GT(calls, 2);
  EXPECT_EQ(far_calls, 0);
  int contacts = 0;
  robot->ForEachContact([&](const ContactPoint& contact) {
    contacts++;
    EXPECT_EQ(contact.a, robot);
  });
  EXPECT_EQ(contacts, 1);
}

TEST(Outlines, LetCallbacksOfContactsDeleteAnything) {
  const auto robots = [] {
    return LoadOutlines(WallAt(1) + Robot("r", kDisc) +
                        Robot("other", std::string(kDisc) + "pose [0 3 0 0]"));
  };
  const auto drive = [](World* world, model_callback_t callback, void* user) {
    for (const char* name : {"r", "other"}) {
      auto* robot = Find<ModelPosition>(*world, name);
      robot->AddCallback(Model::CB_CONTACT, callback, user);
      robot->SetSpeed(0.5, 0, 0);
    }
  };
  const auto world = robots();
  drive(
      world.get(), [](Model* model, void*) { return delete model, 0; }, nullptr);
  Step(*world, 30);
  EXPECT_EQ(world->GetModel("r"), nullptr);
  EXPECT_EQ(world->GetModel("other"), nullptr);

  World* doomed = robots().release();
  bool gone = false;
  drive(
      doomed,
      [](Model* model, void* user) {
        *static_cast<bool*>(user) = true;
        delete model->GetWorld();
        return 0;
      },
      &gone);
  for (int i = 0; i < 100 && !gone; i++) doomed->Update();
  EXPECT_TRUE(gone);
  EXPECT_FALSE(World::Exists(doomed));
}

TEST(Outlines, HitABumperWhereSomethingTouches) {
  const std::string bumper =
      "bumper( name \"b\" alwayson 1 bcount 2 blength 0.1 bpose[0] [0.2 0 0 0] "
      "bpose[1] [-0.2 0 0 180] size [0 0 0] )";
  const auto world = LoadOutlines(WallAt(1) + Robot("r", std::string(kDisc) + bumper));
  auto* robot = Find<ModelPosition>(*world, "r");
  const auto* sensor = Find<ModelBumper>(*world, "r.b");
  robot->SetSpeed(0.5, 0, 0);
  Step(*world, 10);
  ASSERT_NE(sensor->samples, nullptr);
  EXPECT_EQ(sensor->samples[0].hit, nullptr);
  Step(*world, 10);
  EXPECT_EQ(sensor->samples[0].hit, Find<>(*world, "wall"));
  EXPECT_NEAR(sensor->samples[0].hit_point.x, 1, 0.01);
  EXPECT_EQ(sensor->samples[1].hit, nullptr);
  robot->SetSpeed(-0.5, 0, 0);
  Step(*world, 4);
  EXPECT_EQ(sensor->samples[0].hit, nullptr);
}

TEST(Outlines, RefuseAnUnknownContactModel) {
  const LoadOutcome outcome = TryToLoad("contacts \"springs\"\n");
  EXPECT_FALSE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("expected \"cells\" or \"outlines\""), std::string::npos)
      << outcome.errors;
}

}  // namespace
}  // namespace Stg
