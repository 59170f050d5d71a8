// SPDX-License-Identifier: GPL-2.0-or-later
// The stock controllers not in controllers_test.cc: foraging, flocking, zones, demonstrations.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "support/model_testing.hh"

namespace Stg {
namespace {

Pose At(double x, double y) { return Pose(x, y, 0, 0); }

// ---- worlds

class StockRun : public testing::Test {
 protected:
  void Load(const std::string& text) { world_ = LoadText(text); }

  void RunFor(double seconds) {
    const usec_t end = world_->SimTimeNow() + static_cast<usec_t>(std::llround(seconds * 1e6));
    while (world_->SimTimeNow() < end) ASSERT_FALSE(world_->Update());
  }

  /// Runs until the condition holds, at most `seconds`; true if it holds at the end.
  template <class Condition>
  bool RunUntil(double seconds, Condition condition) {
    const usec_t end = world_->SimTimeNow() + static_cast<usec_t>(std::llround(seconds * 1e6));
    while (world_->SimTimeNow() < end) {
      world_->Update();
      if (condition()) return true;
    }
    return false;
  }

  ModelPosition& Robot(const std::string& name = "r") {
    return *Find<ModelPosition>(*world_, name);
  }
  Model& Named(const std::string& name) { return *Find(*world_, name); }

  std::unique_ptr<World> world_;
};

/// A square room around the origin; `side`: inner side, metres.
std::string Room(double side) {
  std::ostringstream text;
  const double middle = side / 2 + 0.1;
  text << "model( size [" << side << " 0.2 1] pose [0 " << middle << " 0 0] )\n"
       << "model( size [" << side << " 0.2 1] pose [0 " << -middle << " 0 0] )\n"
       << "model( size [0.2 " << side << " 1] pose [" << middle << " 0 0 0] )\n"
       << "model( size [0.2 " << side << " 1] pose [" << -middle << " 0 0 0] )\n";
  return text.str();
}

std::string Ring(int count, double from, double step, double range = 5) {
  std::ostringstream text;
  for (int i = 0; i < count; i++)
    text << " sensor( range [0 " << range << "] fov 5 samples 1 pose [0 0 0 " << from + step * i
         << "] )";
  return text.str();
}

/// A robot with sonars, a laser, a fiducial finder and a power pack.
std::string Forager(const std::string& pose, const std::string& more) {
  return "position( name \"r\" size [0.44 0.38 0.22] pose [" + pose + "] " + more +
         " ranger( pose [0 0 -0.1 0] " + Ring(16, 0, 22.5) + " )" +
         " ranger( pose [0 0 -0.1 0] sensor( range [0 8] fov 180 samples 180 ) )" +
         " fiducial( range_max 8 range_max_id 5 fov 180 ) )\n";
}

/// A flat zone, no obstacle and invisible to rangers.
std::string Zone(const std::string& name, const std::string& pose, const std::string& more) {
  return "model( name \"" + name + "\" size [3 3 0.01] pose [" + pose +
         " 0 0] obstacle_return 0 ranger_return -1 " + more + " )\n";
}

std::string Charger(const std::string& pose) {
  return "model( name \"charger\" size [0.3 0.6 0.3] pose [" + pose +
         "] fiducial_return 2 obstacle_return 0 ranger_return -1 joules -1 give_watts 200 "
         "alwayson 1 )\n";
}

// ---- zones

TEST_F(StockRun, SourceMakesAFlagInEachUpdateUntilItIsFull) {
  Load("model( name \"s\" update_interval 200 ctrl \"source 3 10\" )");
  const std::vector<unsigned> expected{0, 1, 1, 2, 2, 3, 3, 3, 3};
  for (const unsigned flags : expected) {
    Step(*world_);
    EXPECT_EQ(Named("s").GetFlagCount(), flags);
  }
  Model::Flag* flag = Named("s").PopFlag();
  EXPECT_TRUE(flag->GetColor() == Color(1, 1, 0));
  EXPECT_EQ(flag->GetSize(), 0.25);
  RunFor(0.4);
  EXPECT_EQ(Named("s").GetFlagCount(), 3u) << "refilled";
}

TEST_F(StockRun, SinkCountsWhatArrives) {
  Load("model( name \"a\" ctrl \"sink\" ) model( name \"b\" ctrl \"sink\" )");
  EXPECT_TRUE(Named("a").HasSubscribers());
  const auto* delivered = static_cast<unsigned long*>(world_->GetProperty("delivered"));
  ASSERT_NE(delivered, nullptr);
  const unsigned long before = *delivered;
  Model::Flag flag(Color(1, 0, 0), 0.1);
  Named("a").PushFlag(&flag);
  Named("b").PushFlag(&flag);
  Named("b").PopFlag();
  EXPECT_EQ(*delivered, before + 2);
}

// ---- foraging

const std::string kPlenty = "joules 1000000 ";
const std::string kLittle = "joules 200 joules_capacity 1000 take_watts 200 ";

TEST_F(StockRun, FasrCarriesFlagsFromTheSourceToTheSink) {
  Load(Room(16) + Zone("source", "-7 -7", "ctrl \"source 10\"") +
       Zone("sink", "7 7", "ctrl \"sink\"") + Forager("-7 -6 0 90", kPlenty + "ctrl \"fasr\""));
  EXPECT_FALSE(RunUntil(2.0, [&] { return Robot().GetFlagCount() > 0; })) << "20 updates to load";
  EXPECT_TRUE(RunUntil(0.5, [&] { return Robot().GetFlagCount() > 0; }));
  EXPECT_TRUE(RunUntil(600, [&] { return Named("sink").GetFlagCount() > 0; }))
      << Robot().PoseString();
  EXPECT_EQ(Robot().GetFlagCount(), 0u);
}

TEST_F(StockRun, FasrRechargesWhenItIsHungry) {
  Load(Room(16) + Zone("source", "-7 -7", "") + Zone("sink", "7 7", "") + Charger("-4.5 -6 0 180") +
       Forager("-6.5 -6 0 0", kLittle + "ctrl \"fasr\""));
  PowerPack* pack = Robot().FindPowerPack();
  ASSERT_NE(pack, nullptr);
  EXPECT_TRUE(RunUntil(60, [&] { return pack->GetCharging(); })) << Robot().PoseString();
  EXPECT_TRUE(RunUntil(60, [&] { return pack->ProportionRemaining() > 0.95; }));
  EXPECT_LT(Robot().GetPose().Distance(Named("charger").GetPose()), 0.6);
  EXPECT_TRUE(RunUntil(60, [&] {
    return Robot().GetPose().Distance(Named("charger").GetPose()) > 1.0;
  })) << Robot().PoseString();
}

/// A cave with a wall in the middle that has an opening in the north.
std::string Fasr2World(const std::string& robots) {
  return "model( name \"cave\" size [20 20 1]\n"
         " block( points 4 point[0] [-10 -10] point[1] [10 -10] point[2] [10 -9.8] point[3] [-10 "
         "-9.8] z [0 1] )\n"
         " block( points 4 point[0] [-10 9.8] point[1] [10 9.8] point[2] [10 10] point[3] [-10 10] "
         "z [0 1] )\n"
         " block( points 4 point[0] [-10 -10] point[1] [-9.8 -10] point[2] [-9.8 10] point[3] [-10 "
         "10] z [0 1] )\n"
         " block( points 4 point[0] [9.8 -10] point[1] [10 -10] point[2] [10 10] point[3] [9.8 10] "
         "z [0 1] )\n"
         " block( points 4 point[0] [-0.1 -10] point[1] [0.1 -10] point[2] [0.1 3] point[3] [-0.1 "
         "3] z [0 1] )\n"
         ")\n" +
         Zone("red_source", "-6 -6", "ctrl \"source 10\" color \"red\"") +
         Zone("red_sink", "6 -6", "ctrl \"sink\" color \"dark red\"") +
         Zone("fuel_zone", "-6 6", "color \"orange\"") + robots;
}

TEST_F(StockRun, Fasr2CarriesFlagsAlongPlannedPaths) {
  Load(Fasr2World(Forager("-3 -3 0 0", kPlenty + "ctrl \"fasr2 red\"")));
  EXPECT_TRUE(Robot().GetColor() == Color("red")) << "that of its goal";
  EXPECT_TRUE(RunUntil(120, [&] { return Robot().GetFlagCount() > 0; })) << Robot().PoseString();
  EXPECT_TRUE(Robot().GetColor() == Color("dark red"));
  EXPECT_TRUE(RunUntil(300, [&] { return Named("red_sink").GetFlagCount() > 0; }))
      << Robot().PoseString();
  EXPECT_TRUE(Robot().GetColor() == Color("red"));
  EXPECT_TRUE(Named("red_sink").PopFlag()->GetColor() == Color(0, 1, 0)) << "delivered";
}

TEST_F(StockRun, Fasr2RechargesAndReturns) {
  Load(Fasr2World(Charger("-4 6 0 180") + Forager("-6.5 6 0 0", kLittle + "ctrl \"fasr2 red\"")));
  PowerPack* pack = Robot().FindPowerPack();
  EXPECT_TRUE(RunUntil(90, [&] { return pack->GetCharging(); })) << Robot().PoseString();
  EXPECT_TRUE(Robot().GetColor() == Color("orange"));
  EXPECT_TRUE(RunUntil(90, [&] { return pack->ProportionRemaining() > 0.95; }));
  EXPECT_TRUE(RunUntil(120, [&] { return Robot().GetColor() == Color("red"); })) << "a new task";
  EXPECT_GE(Robot().GetPose().Distance(Named("charger").GetPose()), 0.19);
  EXPECT_FALSE(Find(*world_, "r.ranger:0")->HasSubscribers()) << "sonars only for undocking";
  EXPECT_TRUE(Find(*world_, "r.ranger:1")->HasSubscribers());
}

TEST_F(StockRun, Fasr2MayRunInSeveralWorlds) {
  for (int i = 0; i < 2; i++) {
    Load(Fasr2World(Forager("-3 -3 0 0", kPlenty + "ctrl \"fasr2 red\"")));
    RunFor(5);
    world_.reset();
  }
}

TEST_F(StockRun, ForagersRepeatWithAnyNumberOfThreads) {
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 4, 1}) {
    World::run_options.threads = threads;
    Load(Fasr2World(Forager("-3 -3 0 0", kPlenty + "ctrl \"fasr2 red\"")));
    RunFor(60);
    hashes.push_back(world_->StateHash());
  }
  World::run_options.threads = 0;
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

// ---- flocking

std::string Flocker(const std::string& name, const std::string& pose) {
  return "position( name \"" + name + "\" size [0.44 0.38 0.22] pose [" + pose +
         "] fiducial_return 1 ctrl \"pioneer_flocking\" ranger( pose [0 0 -0.1 0] " +
         Ring(8, 90, -180.0 / 7) + " ) fiducial( fov 360 ) )\n";
}

TEST_F(StockRun, FlockersAlign) {
  Load(Room(14) + Flocker("a", "-5 -3.2 0 10") + Flocker("b", "-5 3.2 0 -30"));
  const double before = normalize(Robot("a").GetPose().a - Robot("b").GetPose().a);
  RunFor(15);
  const double after = normalize(Robot("a").GetPose().a - Robot("b").GetPose().a);
  EXPECT_LT(std::fabs(after), std::fabs(before) / 2);
  EXPECT_GT(Robot("a").GetPose().Distance(At(-5, -3.2)), 4);
}

TEST_F(StockRun, AFlockerAloneStaysClearOfWalls) {
  Load(Room(8) + Flocker("a", "0 0 0 25"));
  double way = 0;
  for (int second = 0; second < 120; second++) {
    const Pose before = Robot("a").GetPose();
    RunFor(1);
    way += before.Distance(Robot("a").GetPose());
    ASSERT_FALSE(Robot("a").Stalled()) << second;
  }
  EXPECT_GT(way, 5);
}

// ---- demonstrations

/// Log lines of a successful load.
std::string ToldWhileLoading(const std::string& text) {
  std::string told;
  SetLogSink([&](LogLevel, const std::string& line) { told += line + "\n"; });
  EXPECT_TRUE(TryToLoad(text).loaded) << told;
  SetLogSink(nullptr);
  return told;
}

/// Finding the laser prints nothing, whichever ranger it is.
TEST_F(StockRun, LookingForTheLaserIsSilent) {
  for (const char* controller : {"wander", "wander_accel"})
    for (const char* number : {"0", "1", "7", "15"}) {
      const std::string told = ToldWhileLoading(
          "position( name \"r\" ctrl \"" + std::string(controller) +
          "\" ranger( name \"ranger:" + number + "\" sensor( range [0 5] fov 180 samples 90 ) ) )");
      EXPECT_EQ(told.find("warning"), std::string::npos) << told;
      EXPECT_EQ(told.find(controller), std::string::npos) << told;
    }
}

TEST_F(StockRun, RasterizePrintsAPlainBoxAsItsLeftAndLowerBorder) {
  const std::string told =
      ToldWhileLoading("model( name \"box\" size [2 1 1] ctrl \"rasterize\" )");
  std::string picture;
  for (int row = 0; row < 19; row++) picture += "[Rasterize] O" + std::string(39, '.') + "\n";
  picture += "[Rasterize] " + std::string(40, 'O') + "\n";
  EXPECT_NE(told.find(picture), std::string::npos) << told;
  EXPECT_NE(told.find("[Rasterize] box "), std::string::npos);
}

TEST_F(StockRun, DynamicMakesAHundredBoxes) {
  Load("model( name \"m\" pose [5 5 0 0] size [2 2 0.1] ctrl \"dynamic\" )");
  const auto& boxes = Named("m").GetChildren();
  ASSERT_EQ(boxes.size(), 100u);
  for (const Model* box : boxes) {
    EXPECT_LE(std::fabs(box->GetPose().x), 1);
    EXPECT_LE(std::fabs(box->GetPose().y), 1);
    EXPECT_EQ(box->GetGeom().size.x, 0.1);
    EXPECT_EQ(box->GetGeom().size.z, 0.1);
    EXPECT_TRUE(box->GetColor() == Color("blue"));
  }
  EXPECT_NE(boxes[0]->GetPose(), boxes[1]->GetPose());
  RunFor(0.5);
}

TEST_F(StockRun, LaserNoiseComesBeforeTheOthers) {
  Load(
      "model( size [0.2 20 1] pose [4.1 0 0 0] )\n"
      "position( ranger( name \"l\" pose [0 0 -0.1 0] ctrl \"lasernoise\" sensor( range [0 8] fov "
      "0 "
      "samples 2000 ) ) )");
  auto& ranger = *Find<ModelRanger>(*world_, "position:0.l");
  std::vector<double> seen;
  ranger.AddCallback(
      Model::CB_UPDATE,
      [](Model* mod, void* user) {
        *static_cast<std::vector<double>*>(user) =
            static_cast<ModelRanger*>(mod)->GetSensors()[0].ranges;
        return 0;
      },
      &seen);
  RunFor(0.1);
  ASSERT_EQ(seen.size(), 2000u);
  double sum = 0, squares = 0;
  for (const double range : seen) {
    const double factor = range / 4.0;
    sum += factor - 1;
    squares += (factor - 1) * (factor - 1);
  }
  EXPECT_NEAR(sum / 2000, 0, 0.006);
  EXPECT_NEAR(std::sqrt(squares / 2000), 0.05, 0.005);
}

TEST_F(StockRun, WanderAccelSpeedsUpWithinItsBounds) {
  Load(Room(20) +
       "position( name \"r\" pose [-8 0 0 0] size [0.3 0.3 0.3] acceleration_bounds "
       "[-0.2 0.2 0 0 0 0 -45 45] ctrl \"wander_accel\" ranger( pose [0 0 -0.1 0] "
       "sensor( range [0 8] fov 180 samples 180 ) ) )");
  RunFor(1.1);
  EXPECT_NEAR(Robot().GetVelocity().x, 0.2, 1e-9);
  RunFor(2);
  EXPECT_NEAR(Robot().GetVelocity().x, 0.4, 1e-9);
  double way = 0;
  int stalls = 0;
  Velocity last = Robot().GetVelocity();
  for (int step = 0; step < 1200; step++) {
    const Pose before = Robot().GetPose();
    Step(*world_);
    way += before.Distance(Robot().GetPose());
    stalls += Robot().Stalled();
    const Velocity now = Robot().GetVelocity();
    ASSERT_LE(std::fabs(now.x - last.x), 0.02 + 1e-9) << step;
    ASSERT_LE(std::fabs(now.a - last.a), dtor(4.5) + 1e-9) << step;
    last = now;
  }
  EXPECT_GT(way, 20);
  EXPECT_EQ(stalls, 0);
}

// ---- errors

using StockControllersRefusals = StockRun;

/// Expects that loading fails with the message and does not end the process.
void ExpectRefusal(const std::string& text, const char* message) {
  World world;
  const LoadOutcome outcome = TryToLoad(&world, text);
  EXPECT_FALSE(outcome.loaded) << text;
  EXPECT_EQ(outcome.status, 255) << text;
  EXPECT_TRUE(std::regex_search(outcome.errors, std::regex(message))) << outcome.errors;
}

TEST_F(StockControllersRefusals, TheyGiveUpWithAMessage) {
  const std::string zones = Zone("source", "-7 -7", "") + Zone("sink", "7 7", "");
  ExpectRefusal("model( name \"s\" ctrl \"source\" )",
                "source: s: found \"source\", expected a number");
  ExpectRefusal("model( ctrl \"source many\" )", "found \"source many\"");
  ExpectRefusal("model( name \"m\" ctrl \"lasernoise\" )",
                "lasernoise: m: found a model of type model");
  ExpectRefusal("position( ctrl \"wander_accel\" )",
                "wander_accel: position:0: found none of ranger:0");
  ExpectRefusal("model( name \"m\" ctrl \"fasr\" )", "fasr: m: found a model of type model");
  ExpectRefusal("position( ctrl \"fasr\" )", "found no power pack");
  ExpectRefusal("position( joules 1 ctrl \"fasr\" )", "found no ranger:1");
  ExpectRefusal(Forager("0 0 0 0", kPlenty + "ctrl \"fasr\""), "found no model called \"source\"");
  ExpectRefusal("position( joules 1 ctrl \"fasr\" ranger() ranger() ) " + zones,
                "found no fiducial");
  ExpectRefusal(Fasr2World(Forager("0 0 0 0", kPlenty + "ctrl \"fasr2\"")), "found no tasks");
  ExpectRefusal(Fasr2World(Forager("0 0 0 0", kPlenty + "ctrl \"fasr2 red green\"")),
                "found no model called \"green_source\"");
  ExpectRefusal("position( ctrl \"pioneer_flocking\" )", "found no ranger that is not in use");
  ExpectRefusal("position( ctrl \"pioneer_flocking\" ranger() )", "expected 8");
}

// ---- stest

struct Outcome {
  int status;
  std::string output;  ///< standard output and error
};

class StestTest : public testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("STAGE_BINARY_DIR");
    program_ = std::string(folder ? folder : ".") + "/bin/stest";
    if (!std::filesystem::exists(program_)) GTEST_SKIP() << "needs " << program_;
  }

  Outcome RunIt(const std::string& arguments) {
    FILE* pipe = popen((program_ + " " + arguments + " 2>&1").c_str(), "r");
    Outcome run{-1, ""};
    char text[4096];
    while (const size_t count = std::fread(text, 1, sizeof text, pipe))
      run.output.append(text, count);
    run.status = WEXITSTATUS(pclose(pipe));
    return run;
  }

  std::string program_;
};

TEST_F(StestTest, ExplainsItself) {
  for (const char* arguments : {"", "my.world"}) {
    const Outcome run = RunIt(arguments);
    EXPECT_EQ(run.status, 0);
    EXPECT_NE(run.output.find("usage: "), std::string::npos) << run.output;
  }
}

TEST_F(StestTest, RunsAWorldToItsEnd) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("stest" + std::to_string(getpid()) + ".world");
  std::ofstream(path) << "quit_time 20\n"
                      << Room(8) << "position( name \"r0\" size [0.3 0.3 0.3] pose "
                      << "[-3 -3 0 45] ranger( pose [0 0 -0.1 0] " << Ring(8, -90, 180.0 / 7)
                      << " ) )\n";
  const Outcome good = RunIt(path.string() + " 1");
  EXPECT_EQ(good.status, 0) << good.output;
  const Outcome missing = RunIt(path.string() + " 2");
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.output.find("found no model called \"r1\""), std::string::npos)
      << missing.output;
  EXPECT_EQ(RunIt(path.string() + " many").status, 1);
  EXPECT_NE(RunIt(path.string() + ".none 1").status, 0);
  std::filesystem::remove(path);
}

// ---- reference runs, with pictures that are not part of this project

TEST_F(StockRun, ReferenceRasterizeOfTheCave) {
  const char* folder = std::getenv("STAGE_SHARED_DIR");
  const std::string cave = std::string(folder ? folder : "") + "/stage-worlds/bitmaps/cave.png";
  if (!folder || !std::filesystem::exists(cave))
    GTEST_SKIP() << "needs STAGE_SHARED_DIR/stage-worlds";
  const std::string told = ToldWhileLoading(
      "model( size [16 16 0.6] boundary 1 ctrl \"rasterize\" bitmap \"" + cave + "\" )");
  std::vector<std::string> rows;
  std::istringstream lines(told);
  for (std::string line; std::getline(lines, line);)
    if (line.rfind("[Rasterize] ", 0) == 0 && line.size() == 52) rows.push_back(line.substr(12));
  ASSERT_EQ(rows.size(), 20u) << told;
  EXPECT_EQ(rows.front(), std::string(40, 'O'));
  EXPECT_EQ(rows.back(), std::string(40, 'O'));
  size_t inside = 0;
  for (const std::string& row : rows) {
    EXPECT_EQ(row.front(), 'O');
    EXPECT_EQ(row.back(), 'O');
    for (const char c : row) inside += c == 'O';
  }
  EXPECT_GT(inside, 116u + 50) << "walls inside the frame";
  EXPECT_LT(inside, 400u);
}

}  // namespace
}  // namespace Stg
