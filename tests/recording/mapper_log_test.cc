// SPDX-License-Identifier: GPL-2.0-or-later
//
// Messages with one stamp in a log belong to one instant: a mapper reading the log finds the walls.

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "recording/log_testing.hh"
#include "recording/ros_messages.hh"
#include "support/mapper.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"

namespace log_testing {

namespace {

struct Pose3 {  // x, y (metres) and heading (radians)
  double x = 0, y = 0, a = 0;
  Pose3 operator*(const Pose3& inner) const {
    return {x + inner.x * std::cos(a) - inner.y * std::sin(a),
            y + inner.x * std::sin(a) + inner.y * std::cos(a), a + inner.a};
  }
};

Pose3 PlaceOf(CdrReader* from) {
  double numbers[7];
  for (double& number : numbers) number = from->Get<double>();
  return {numbers[0], numbers[1], 2 * std::atan2(numbers[5], numbers[6])};
}

struct Scan {
  uint64_t time;
  std::string frame;
  float first, increment, time_increment;
  std::vector<double> ranges;
};

/// A log's messages by the stamp in their headers.
struct Contents {
  using Key = std::pair<std::string, uint64_t>;
  std::map<Key, std::pair<std::string, Pose3>> transforms;  // by child frame: parent and pose
  std::map<std::string, std::pair<std::string, Pose3>> fixed;
  std::map<Key, Pose3> odometry;
  std::vector<Scan> scans;

  explicit Contents(const McapReader& log) {
    for (const ReadMessage& message : MessagesOf(log)) Read(message);
  }
  void Read(const ReadMessage& message) {
    CdrReader from(message.data);
    if (message.type == "tf2_msgs/msg/TFMessage") {
      const auto count = from.Get<uint32_t>();
      for (uint32_t i = 0; i < count; i++) {
        const Header header(&from);
        const std::string child(from.GetText());
        const Pose3 place = PlaceOf(&from);
        if (message.topic == "/tf_static")
          fixed[child] = {header.frame, place};
        else
          EXPECT_TRUE(transforms.insert({{child, header.time()}, {header.frame, place}}).second)
              << child << " twice at " << header.time();
      }
    } else if (message.type == "nav_msgs/msg/Odometry") {
      const Header header(&from);
      from.GetText();
      odometry[{message.topic, header.time()}] = PlaceOf(&from);
    } else if (message.type == "sensor_msgs/msg/LaserScan") {
      Scan scan;
      const Header header(&from);
      scan.time = header.time();
      scan.frame = header.frame;
      scan.first = from.Get<float>();
      from.Get<float>();
      scan.increment = from.Get<float>();
      scan.time_increment = from.Get<float>();
      std::vector<double> intensities;
      recording::GetScan(message.data, &scan.ranges, &intensities);
      scans.push_back(scan);
    }
  }
  /// Pose of a frame in the map at exactly that time.
  Pose3 InMap(std::string frame, uint64_t time) const {
    Pose3 place;
    while (frame != "map") {
      const auto still = fixed.find(frame);
      const auto moving = transforms.find({frame, time});
      if (still == fixed.end() && moving == transforms.end()) {
        ADD_FAILURE() << "no transform of " << frame << " at " << time;
        return place;
      }
      const auto& [parent, inner] = still != fixed.end() ? still->second : moving->second;
      place = inner * place;
      frame = parent;
    }
    return place;
  }
};

/// Loads a world with a robot "r", which drives ahead and turns.
void LoadDriven(World* world, const std::string& text) {
  std::istringstream content(text);
  ASSERT_TRUE(world->Load(content));
  dynamic_cast<ModelPosition&>(*world->GetModel("r")).SetSpeed(0.5, 0, 1.2);
}

/// Pose of a frame in the map at any time, microseconds, interpolated between steps of that length.
Pose3 InMapBetween(const Contents& contents, const std::string& frame, double time, double step) {
  const double before = std::floor(time / step) * step, after = std::ceil(time / step) * step;
  const Pose3 a = contents.InMap(frame, static_cast<uint64_t>(before * 1e3));
  if (after == before) return a;
  const Pose3 b = contents.InMap(frame, static_cast<uint64_t>(after * 1e3));
  const double part = (time - before) / step;
  return {a.x + part * (b.x - a.x), a.y + part * (b.y - a.y),
          a.a + part * std::remainder(b.a - a.a, 2 * M_PI)};
}

class MapperOfALog : public LogTest {
 protected:
  /// Maps the end points of all scans, using the transforms with the same stamp.
  Mapper MakeOccupancyMap(const std::string& world_text, int steps,
                          const recording::LogOptions& options) {
    World world(OptionsOf(1));
    std::istringstream text(world_text);
    EXPECT_TRUE(world.Load(text));
    for (Model* model : world.GetAllModels())
      if (auto* robot = dynamic_cast<ModelPosition*>(model); robot && !robot->Parent())
        robot->SetSpeed(0.5, 0, 1.2);
    Log(&world, steps, "run.mcap", options);
    const Contents contents{McapReader(Path("run.mcap"))};
    ExpectTruthFits(contents);
    return EndPointsOf(contents);
  }
  static Mapper EndPointsOf(const Contents& contents) {
    Mapper mapper;
    for (const Scan& scan : contents.scans) {
      const Pose3 sensor = contents.InMap(scan.frame, scan.time);
      for (size_t i = 0; i < scan.ranges.size(); i++)
        mapper.Add(Pose(sensor.x, sensor.y, 0, sensor.a),
                   scan.first + static_cast<double>(i) * scan.increment, scan.ranges[i]);
    }
    return mapper;
  }
  /// Without odometry errors, the ground truth equals the transforms.
  static void ExpectTruthFits(const Contents& contents) {
    for (const auto& [key, truth] : contents.odometry) {
      if (!key.first.ends_with("ground_truth")) continue;
      const Pose3 believed = contents.InMap("base_footprint", key.second);
      EXPECT_NEAR(believed.x, truth.x, 1e-9) << key.second;
      EXPECT_NEAR(believed.y, truth.y, 1e-9);
      EXPECT_NEAR(std::remainder(believed.a - truth.a, 2 * M_PI), 0, 1e-9);
    }
  }
};

std::string TextOf(int step, int interval, const std::string& robot, const std::string& rest = "") {
  return "interval_sim " + std::to_string(step) + "\n" +
         Room("position( pose [1 -2 0 30] size [0.4 0.4 0.4] alwayson 1 " + robot +
              " odom_error [0 0 0 0] " + rest + " ranger( alwayson 1 update_interval " +
              std::to_string(interval) +
              " pose [0.05 0.02 0 5] sensor( pose [0.05 0 0 10] range [0 20] fov 350 samples 36"
              " ) ) )");
}

TEST_F(MapperOfALog, FindsTheWallsWhereTheyAre) {
  for (const char* localization : {"gps", "odom"})
    for (const int step : {5, 20, 100})
      for (const int interval : {step, 30, 100})
        for (const usec_t every : {0, 300}) {
          recording::LogOptions options;
          options.every = every * 1000;
          Mapper mapper = MakeOccupancyMap(
              TextOf(step, interval, "localization \"" + std::string(localization) + "\""),
              (kSanitized ? 2000 : 6000) / step, options);
          const std::string what = std::string(localization) + ", steps of " +
                                   std::to_string(step) + " ms, scans each " +
                                   std::to_string(interval) + " ms, logged each " +
                                   std::to_string(every);
          mapper.Print(what);
          EXPECT_GT(mapper.points(), 100u) << what;
          // Ranges and angles are 32-bit floats.
          EXPECT_LT(mapper.Quantile(1), 1e-5) << what;
        }
}

// The scanner is at the robot's centre, because transforms are interpolated for the robot.
TEST_F(MapperOfALog, FindsThemByScansThatTakeTime) {
  const std::string text =
      "interval_sim 20\n" +
      Room(
          "position( name \"r\" pose [1 -2 0 30] size [0.4 0.4 0.4] alwayson 1 update_interval 20"
          " localization \"gps\" ranger( alwayson 1 update_interval 100 sensor( range [0 20]"
          " fov 350 samples 36 time_increment 0.002 ) ) )");
  World world(OptionsOf(1));
  ASSERT_NO_FATAL_FAILURE(LoadDriven(&world, text));
  Log(&world, 300, "run.mcap");
  const Contents contents{McapReader(Path("run.mcap"))};
  Mapper at_once, one_by_one;
  for (const Scan& scan : contents.scans) {
    ASSERT_FLOAT_EQ(scan.time_increment, 0.002F);
    const double start = static_cast<double>(scan.time) / 1e3;
    ASSERT_NEAR(std::fmod(start, 1e5), 3e4, 0.5) << "70 ms before a multiple of 100 ms";
    if (start < 2e5) continue;  // transforms begin with the first step
    for (size_t i = 0; i < scan.ranges.size(); i++) {
      const double bearing = scan.first + static_cast<double>(i) * scan.increment;
      const auto add = [&](double time, Mapper* to) {
        const Pose3 sensor = InMapBetween(contents, scan.frame, time, 2e4);
        to->Add(Pose(sensor.x, sensor.y, 0, sensor.a), bearing, scan.ranges[i]);
      };
      add(start + static_cast<double>(i) * 2e3, &one_by_one);
      add(start, &at_once);
    }
  }
  one_by_one.Print("scans that take 70 ms, each ray at its time");
  at_once.Print("scans that take 70 ms, all rays at the time of the first");
  EXPECT_GT(one_by_one.points(), 1000u);
  EXPECT_LT(one_by_one.Quantile(1), 1e-5);
  EXPECT_GT(at_once.Quantile(0.9), 0.02);
}

TEST_F(MapperOfALog, FindsThemWithASensorThatAnActuatorTurns) {
  const std::string text =
      "interval_sim 20\n" +
      Room(
          "position( name \"r\" alwayson 1 localization \"odom\" odom_error [0 0 0 0]"
          " actuator( alwayson 1 type \"rotational\" max_speed 2 min_position -100"
          " max_position 100 ranger( alwayson 1 sensor( range [0 20] fov 350 samples 36"
          " ) ) ) )");
  World world(OptionsOf(1));
  ASSERT_NO_FATAL_FAILURE(LoadDriven(&world, text));
  dynamic_cast<ModelActuator&>(*world.GetModel("r.actuator:0")).SetSpeed(1.5);
  Log(&world, 300, "run.mcap");
  Mapper mapper = EndPointsOf(Contents{McapReader(Path("run.mcap"))});
  EXPECT_GT(mapper.points(), 1000u);
  EXPECT_LT(mapper.Quantile(1), 1e-5);
}

// A robot without subscribers stands still, but could be moved.
TEST_F(MapperOfALog, FindsThemWithARobotThatNobodyRuns) {
  for (const char* localization : {"gps", "odom"}) {
    const std::string robot =
        "position( name \"r\" localization \"" + std::string(localization) +
        "\" pose [1 2 0 20] ranger( alwayson 1 sensor( range [0 20] fov 350 samples 36 ) ) )";
    Mapper mapper = MakeOccupancyMap(Room(robot), 20, {});
    EXPECT_EQ(mapper.points(), 36u * 20);
    EXPECT_LT(mapper.Quantile(1), 1e-5) << localization;
  }
}

}  // namespace

}  // namespace log_testing
