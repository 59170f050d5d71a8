// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs contain the world's data; logging does not change the run.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "recording/log_testing.hh"
#include "recording/robots.hh"
#include "recording/ros_messages.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"
#include "world/engine.hh"

namespace log_testing {

namespace {

constexpr int kSteps = kSanitized ? 8 : 40;

using Floats = std::vector<float>;

template <typename T>
std::vector<T> Elements(std::string_view bytes) {
  std::vector<T> elements(bytes.size() / sizeof(T));
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(elements.data()));
  return elements;
}

/// Readings in the convention of REP 117.
Floats LoggedRanges(const ModelRanger::Sensor& sensor) {
  Floats floats;
  for (const double range : sensor.ranges)
    floats.push_back(range >= sensor.range.max ? HUGE_VALF : static_cast<float>(range));
  return floats;
}

/// Collects a world's data after each step, by topic.
class Witness {
 public:
  explicit Witness(World* world) : world_(*world) {}
  void Look() {
    const uint64_t now = recording::Nanoseconds(world_.SimTimeNow());
    for (const recording::Robot& robot : recording::RobotsOf(world_.engine().models)) {
      if (robot.position) {
        estimates[{robot.topics + "odom", now}] = robot.position->est_pose;
        estimates[{robot.topics + "ground_truth", now}] = robot.position->GetSensedPose();
      }
      for (const recording::ScanSource& scan : robot.scans) {
        const ModelRanger::Sensor& sensor = scan.ranger->GetSensors()[scan.sensor];
        ranges[{scan.topic, now}] = LoggedRanges(sensor);
        if (!sensor.ranges.empty()) seen.insert(scan.topic);
      }
    }
  }
  using Key = std::pair<std::string, uint64_t>;
  std::map<Key, Pose> estimates;
  std::map<Key, Floats> ranges;
  std::set<std::string> seen;  // topics that had readings at any time

 private:
  World& world_;
};

void ExpectScan(const ReadMessage& message, const Witness& witness) {
  CdrReader from(message.data);
  const Header header(&from);
  EXPECT_EQ(header.time(), message.time) << message.topic;
  EXPECT_NE(header.frame.find("base_scan_link"), std::string::npos);
  float numbers[7];
  for (float& number : numbers) number = from.Get<float>();
  const auto ranges = Elements<float>(from.GetSequence<float>());
  const auto intensities = Elements<float>(from.GetSequence<float>());
  ASSERT_TRUE(from.is_good());
  EXPECT_EQ(ranges, witness.ranges.at({message.topic, message.time})) << message.topic;
  EXPECT_EQ(intensities.size(), ranges.size());
  const double last = numbers[0] + numbers[2] * static_cast<double>(ranges.size() - 1);
  if (ranges.size() > 1) {
    EXPECT_NEAR(last, numbers[1], 1e-4) << message.topic;
  }
}

void ExpectOdometry(const ReadMessage& message, const Witness& witness) {
  CdrReader from(message.data);
  const Header header(&from);
  EXPECT_EQ(header.time(), message.time);
  from.GetText();
  double place[7];
  for (double& number : place) number = from.Get<double>();
  const Pose& expected = witness.estimates.at({message.topic, message.time});
  EXPECT_EQ(place[0], expected.x) << message.topic;
  EXPECT_EQ(place[1], expected.y);
  EXPECT_EQ(place[2], expected.z);
  EXPECT_NEAR(std::remainder(2 * std::atan2(place[5], place[6]) - expected.a, 2 * M_PI), 0, 1e-12);
}

/// Adds the parent frame of each child frame of the message.
void NoteFrames(const ReadMessage& message, std::map<std::string, std::string>* parents) {
  CdrReader from(message.data);
  const auto count = from.Get<uint32_t>();
  for (uint32_t i = 0; i < count; i++) {
    const Header header(&from);
    (*parents)[std::string(from.GetText())] = header.frame;
    for (int k = 0; k < 7; k++) from.Get<double>();
  }
  EXPECT_TRUE(from.is_good());
}

void ExpectAllFramesHangTogether(const std::map<std::string, std::string>& parents,
                                 const std::set<std::string>& used) {
  for (std::string frame : used) {
    for (int i = 0; i < 5 && parents.contains(frame); i++) frame = parents.at(frame);
    EXPECT_EQ(frame, "map");
  }
}

class EveryLog : public LogTest {
 protected:
  void ExpectLogOf(const std::string& file) {
    SCOPED_TRACE(file);
    const std::unique_ptr<World> plain = LoadFile(file, 3), logged = LoadFile(file, 3);
    Run(plain.get(), kSteps);
    Witness witness(logged.get());
    Log(logged.get(), kSteps, "run.mcap", {}, [&] { witness.Look(); });
    EXPECT_EQ(plain->StateHash(), logged->StateHash());
    ExpectRead(witness, logged->sim_interval);
  }

  void ExpectRead(const Witness& witness, usec_t interval) {
    const McapReader log(Path("run.mcap"));
    EXPECT_FALSE(log.ends_early());
    std::map<std::string, int> counts;
    std::map<std::string, std::string> parents;
    std::set<std::string> used, scanned;
    uint64_t clock = 0;
    for (const ReadMessage& message : MessagesOf(log)) {
      counts[message.topic]++;
      if (message.type == "sensor_msgs/msg/LaserScan") {
        ExpectScan(message, witness);
        scanned.insert(message.topic);
        CdrReader from(message.data);
        used.insert(Header(&from).frame);
      } else if (message.type == "nav_msgs/msg/Odometry") {
        ExpectOdometry(message, witness);
      } else if (message.type == "tf2_msgs/msg/TFMessage") {
        NoteFrames(message, &parents);
      } else if (message.topic == "/clock") {
        const uint64_t expected = clock + recording::Nanoseconds(interval);
        EXPECT_EQ(message.time, counts["/clock"] == 1 ? 0 : expected);
        clock = message.time;
      }
    }
    EXPECT_EQ(counts["/clock"], kSteps + 1);
    EXPECT_EQ(counts["/stage/poses"], kSteps + 1);
    EXPECT_EQ(scanned, witness.seen);
    ExpectAllFramesHangTogether(parents, used);
  }
};

TEST_F(EveryLog, OfAShippedWorldEqualsTheWorld) {
  for (const std::string& file : ShippedWorlds()) ExpectLogOf(file);
}

class LogFile : public LogTest {
 protected:
  std::string LogWith(const std::string& name, const RunOptions& options,
                      const recording::LogOptions& log = {}) {
    World world(options);
    EXPECT_TRUE(world.Load(SourceFile("worlds/cave.world")));
    Log(&world, kSteps, name, log);
    return BytesOf(Path(name));
  }
};

TEST_F(LogFile, HasTheSameBytesOnAnyNumberOfThreads) {
  const std::string one = LogWith("1.mcap", OptionsOf(1));
  ASSERT_GT(one.size(), 100000u);
  for (const int threads : {2, 3}) {
    RunOptions options = OptionsOf(1);
    options.threads = threads;
    options.share_from = 2;
    EXPECT_TRUE(LogWith("n.mcap", options) == one) << threads;
  }
  RunOptions in_turn = OptionsOf(1);
  in_turn.batch = false;
  EXPECT_TRUE(LogWith("n.mcap", in_turn) == one);
}

TEST_F(LogFile, HasTheSameContentsWithEachCompression) {
  std::vector<std::string> texts;
  for (const auto compression : {recording::Compression::kNone, recording::Compression::kLz4,
                                 recording::Compression::kZstd}) {
    if (!recording::IsAvailable(compression)) continue;
    recording::LogOptions log;
    log.compression = compression;
    LogWith("c.mcap", OptionsOf(1), log);
    std::string& text = texts.emplace_back();
    for (const ReadMessage& message : MessagesOf(McapReader(Path("c.mcap"))))
      text += message.topic + std::to_string(message.time) + message.data;
  }
  for (const std::string& text : texts) EXPECT_TRUE(text == texts[0]);
}

const char kThree[] = R"(
define bot position( size [0.4 0.4 0.4] alwayson 1 localization "odom"
  ranger( alwayson 1 sensor( range [0 5] fov 90 samples 5 ) ) velocity [0.2 0 0 10] )
bot( name "a" pose [0 0 0 0] ) bot( name "b:1" pose [2 0 0 90] ) bot( name "2c" pose [4 0 0 0] )
model( name "post" pose [0 3 0 0] size [0.2 0.2 1] ranger( alwayson 1 sensor( samples 3 ) ) )
model( name "wall" pose [0 5 0 0] size [9 0.2 1] )
)";

class LogOfThree : public LogTest {
 protected:
  std::map<std::string, std::vector<uint64_t>> TimesOf(const recording::LogOptions& options) {
    World world(OptionsOf(1));
    std::istringstream text(kThree);
    EXPECT_TRUE(world.Load(text));
    Log(&world, 10, "three.mcap", options);
    std::map<std::string, std::vector<uint64_t>> times;
    for (const ReadMessage& message : MessagesOf(McapReader(Path("three.mcap"))))
      times[message.topic].push_back(message.time / 1'000'000);
    return times;
  }
};

TEST_F(LogOfThree, NamesAreThoseThatRosAllows) {
  const auto times = TimesOf({});
  for (const char* topic :
       {"/a/odom", "/a/ground_truth", "/a/base_scan", "/b_1/odom", "/_2c/base_scan",
        "/post/base_scan", "/tf", "/tf_static", "/clock", "/map", "/stage/poses"})
    EXPECT_TRUE(times.contains(topic)) << topic;
  EXPECT_FALSE(times.contains("/post/odom"));
  EXPECT_EQ(times.at("/a/odom").size(), 11u);
  EXPECT_EQ(times.at("/a/base_scan").size(), 10u);
  EXPECT_EQ(times.at("/map").size(), 1u);
}

TEST_F(LogOfThree, PeriodAndModelsSelectMessages) {
  recording::LogOptions options;
  options.every = 300000;
  options.robots = {"b*", "2c"};
  const auto times = TimesOf(options);
  EXPECT_EQ(times.at("/clock"), (std::vector<uint64_t>{0, 300, 600, 900}));
  EXPECT_EQ(times.at("/b_1/base_scan"), (std::vector<uint64_t>{300, 600, 900}));
  EXPECT_TRUE(times.contains("/_2c/odom"));
  EXPECT_FALSE(times.contains("/a/odom"));
  EXPECT_FALSE(times.contains("/post/base_scan"));
}

TEST_F(LogOfThree, ARobotThatIsNotThereIsAnError) {
  recording::LogOptions options;
  options.robots = {"nobody"};
  EXPECT_THROW(TimesOf(options), std::runtime_error);
}

TEST_F(LogFile, WriteFailureEndsTheRun) {
  World world(OptionsOf(1));
  ASSERT_TRUE(world.Load(SourceFile("worlds/cave.world")));
  recording::LogOptions options;
  options.file = "/dev/full";
  recording::Recorder recorder(options);
  recorder.Attach(&world);
  for (int i = 0; i < 2000 && !world.Update(); i++) {
  }
  EXPECT_TRUE(world.TestQuit());
  EXPECT_THROW(recorder.Finish(), std::runtime_error);
}

TEST_F(LogFile, OtherFilesAreNotReplaced) {
  WriteBytes(Path("notes"), "mine");
  recording::LogOptions options;
  options.file = Path("notes");
  EXPECT_THROW(recording::Recorder{options}, std::runtime_error);
  EXPECT_EQ(BytesOf(Path("notes")), "mine");
}

TEST_F(LogFile, SurvivesCreationAndDeletionOfModels) {
  World world(OptionsOf(1));
  std::istringstream text(kThree);
  ASSERT_TRUE(world.Load(text));
  recording::LogOptions options;
  options.file = Path("run.mcap");
  recording::Recorder recorder(options);
  recorder.Attach(&world);
  for (int i = 0; i < 30; i++) {
    if (i == 10) delete world.GetModel("b:1");
    if (i == 20) world.CreateModel(nullptr, "position")->Subscribe();
    world.Update();
  }
  recorder.Finish();
  std::map<std::string, int> counts;
  for (const ReadMessage& message : MessagesOf(McapReader(Path("run.mcap"))))
    counts[message.topic]++;
  EXPECT_EQ(counts["/a/odom"], 31);
  EXPECT_EQ(counts["/b_1/odom"], 11);
  EXPECT_GE(counts["/position_4/odom"] + counts["/position_3/odom"] + counts["/position_0/odom"],
            9);
}

TEST_F(LogFile, EndsWhenItsWorldIsUnloaded) {
  World world(OptionsOf(1));
  std::istringstream text(kThree), again(kThree);
  ASSERT_TRUE(world.Load(text));
  recording::LogOptions options;
  options.file = Path("run.mcap");
  recording::Recorder recorder(options);
  recorder.Attach(&world);
  Run(&world, 5);
  ASSERT_TRUE(world.Load(again));
  Run(&world, 5);
  recorder.Finish();
  uint64_t last = 0;
  for (const ReadMessage& message : MessagesOf(McapReader(Path("run.mcap")))) last = message.time;
  EXPECT_EQ(last, 500'000'000u);
}

/// Logs what a radio has received in the step of its time stamp.
TEST_F(EveryLog, ContainsTheMessagesOfRadios) {
  World world(OptionsOf(1));
  std::istringstream text(
      "define bot position( size [0.2 0.2 0.2] alwayson 1 radio( alwayson 1 range 5 ) )\n"
      "bot( name \"r\" ) bot( name \"s\" pose [3 0 0 90] )");
  ASSERT_TRUE(world.Load(text));
  auto *sender = dynamic_cast<ModelRadio*>(world.GetModel("r.radio:0")),
       *receiver = dynamic_cast<ModelRadio*>(world.GetModel("s.radio:0"));
  ASSERT_TRUE(sender && receiver && sender->Send("hello", 5));
  Log(&world, 1, "run.mcap");
  const McapReader log(Path("run.mcap"));
  int found = 0;
  for (const ReadMessage& message : MessagesOf(log)) {
    if (message.topic != "/s/readings/radio") continue;
    CdrReader from(message.data);
    EXPECT_EQ(Header(&from).time(), message.time);
    EXPECT_EQ(from.Get<int32_t>(), 1);
    EXPECT_EQ(Elements<int32_t>(from.GetSequence<int32_t>()),
              std::vector<int32_t>{static_cast<int32_t>(sender->GetId())});
    EXPECT_EQ(Elements<double>(from.GetSequence<double>()), std::vector<double>{3});
    EXPECT_EQ(Elements<double>(from.GetSequence<double>()),
              std::vector<double>{receiver->Received()[0].bearing});
    EXPECT_EQ(Elements<double>(from.GetSequence<double>()), std::vector<double>{0});
    EXPECT_EQ(Elements<int32_t>(from.GetSequence<int32_t>()), std::vector<int32_t>{5});
    EXPECT_EQ(from.GetSequence<uint8_t>(), "hello" + std::string(59, '\0'));
    EXPECT_TRUE(from.is_good());
    found++;
  }
  EXPECT_EQ(found, 1);
}

TEST_F(LogTest, FieldsAreLoggedOncePerInterval) {
  World world(OptionsOf(1));
  std::istringstream text(
      "interval_sim 100\n"
      "field( name \"warm air\" pose [3 1 0 90] size [2 1 0] field_resolution 0.5 initial 2 )\n"
      "field( name \"brief\" log_interval 250 evaporation 1 initial 1 )\n"
      "field( name \"secret\" log_interval 0 )");
  ASSERT_TRUE(world.Load(text));
  Log(&world, 20, "run.mcap");
  std::map<std::string, std::vector<uint64_t>> times;
  for (const ReadMessage& message : MessagesOf(McapReader(Path("run.mcap")))) {
    if (message.type != "stage_msgs/msg/Field") continue;
    times[message.topic].push_back(message.time / 1'000'000);
    if (message.topic != "/fields/warm_air") continue;
    CdrReader from(message.data);
    const Header header(&from);
    EXPECT_EQ(header.time(), message.time);
    EXPECT_EQ(header.frame, "map");
    EXPECT_EQ(from.Get<double>(), 3);
    EXPECT_EQ(from.Get<double>(), 1);
    for (int i = 0; i < 5; i++) from.Get<double>();
    EXPECT_EQ(from.Get<double>(), 0.5);
    EXPECT_EQ(from.Get<double>(), 0.5);
    EXPECT_EQ(from.Get<uint32_t>(), 4u);
    EXPECT_EQ(from.Get<uint32_t>(), 2u);
    EXPECT_EQ(from.GetSequence<double>().size(), 8 * sizeof(double));
    std::vector<double> values;
    EXPECT_TRUE(recording::GetFieldValues(message.data, &values));
    EXPECT_EQ(values, std::vector<double>(8, 2.0));
    EXPECT_FALSE(recording::GetFieldValues(
        std::string_view(message.data).substr(0, message.data.size() - 1), &values));
  }
  using Times = std::vector<uint64_t>;
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times["/fields/warm_air"], (Times{0, 1000, 2000}));
  EXPECT_EQ(times["/fields/brief"], (Times{0, 300, 500, 800, 1000, 1300, 1500, 1800, 2000}));
}

}  // namespace

}  // namespace log_testing
