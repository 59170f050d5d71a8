// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replays show the recorded run, also from logs that are cut off; damaged logs are rejected with a
// message of one line.

#include "recording/replay.hh"

#include <algorithm>

#include "recording/log_testing.hh"
#include "recording/mcap_writer.hh"
#include "support/mapper.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "support/shipped_worlds.hh"
#include "world/engine.hh"

namespace log_testing {

namespace {

constexpr int kSteps = kSanitized ? 10 : 40;

/// The time, and each model's pose and readings by id.
struct Shown {
  usec_t time;
  std::map<uint32_t, std::string> models;
};

Shown SceneOf(World* world) {
  Shown scene = {world->SimTimeNow(), {}};
  for (Model* model : world->engine().models) {
    const Pose pose = model->GetGlobalPose();
    std::ostringstream line;
    line << model->Token() << ' ' << std::hexfloat << pose.x << ' ' << pose.y << ' ' << pose.a;
    if (auto* ranger = dynamic_cast<ModelRanger*>(model))
      for (const ModelRanger::Sensor& sensor : ranger->GetSensors()) {
        for (const double range : sensor.ranges)  // a controller's noise may exceed the bounds
          line << ' ' << static_cast<float>(std::clamp(range, sensor.range.min, sensor.range.max));
        line << " of " << sensor.bearings.size();
      }
    scene.models[model->GetId()] = line.str();
  }
  return scene;
}

/// Expects the replay to show `was`, except for models created by controllers.
void ExpectShown(World* replay, const Shown& was) {
  const Shown now = SceneOf(replay);
  EXPECT_EQ(now.time, was.time);
  for (const auto& [id, line] : now.models) ASSERT_EQ(line, was.models.at(id)) << was.time;
}

class ReplayTest : public LogTest {
 protected:
  static std::unique_ptr<World> LoadFrom(const recording::Replay& replay) {
    const recording::UnpackedFiles files(replay.files());
    RunOptions options = OptionsOf(1);
    options.controllers = false;
    auto world = std::make_unique<World>(options);
    EXPECT_TRUE(world->Load(files.world_file()));
    return world;
  }
  /// Error of opening the log or reading its chunks; empty if it can be replayed.
  std::string ProblemOf(const std::string& bytes) const {
    WriteBytes(Path("damaged.mcap"), bytes);
    try {
      const recording::Replay replay(Path("damaged.mcap"));
      const McapReader log(Path("damaged.mcap"));
      recording::Buffer records;
      for (const McapReader::Chunk& chunk : log.chunks()) log.Read(chunk, &records);
      return "";
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
  }
  /// Returns the bytes of a log of several chunks.
  std::string LargeLog() {
    const std::unique_ptr<World> world = LoadFile(SourceFile("worlds/cave.world"), 1);
    Log(world.get(), 10, "large.mcap");
    EXPECT_GT(McapReader(Path("large.mcap")).chunks().size(), 1u);
    return BytesOf(Path("large.mcap"));
  }

  void ExpectReplayed(const std::string& file, int steps) {
    SCOPED_TRACE(file);
    const std::unique_ptr<World> original = LoadFile(file, 2);
    std::vector<Shown> scenes;
    Log(original.get(), steps, "run.mcap", {}, [&] { scenes.push_back(SceneOf(original.get())); });
    recording::Replay replay(Path("run.mcap"));
    const std::unique_ptr<World> world = LoadFrom(replay);
    replay.Attach(world.get());
    const usec_t step = world->sim_interval;
    EXPECT_EQ(replay.end(), step * static_cast<usec_t>(steps));
    for (int i = 0; i <= steps; i++) {
      ExpectShown(world.get(), scenes[static_cast<size_t>(i)]);
      world->Update();
    }
    for (const int i : {steps / 2, 1, steps, 0}) {
      replay.SeekTo(step * static_cast<usec_t>(i));
      ExpectShown(world.get(), scenes[static_cast<size_t>(i)]);
    }
    world->Update();
    ExpectShown(world.get(), scenes[1]);
  }
};

TEST_F(ReplayTest, ShowsEveryShippedWorldAsItWasAndGoesBack) {
  for (const std::string& file : ShippedWorlds()) ExpectReplayed(file, kSteps);
}

TEST_F(ReplayTest, ShowsThingsThatWerePushed) {
  ExpectReplayed(SourceFile("worlds/push.world"), 200);
}

/// A replay shows a scan from the pose before the moves of its step, like the run itself.
TEST_F(ReplayTest, ShowsScansOnTheWallsWhileTheRobotTurns) {
  for (const int step : {20, 100}) {
    World original(OptionsOf(1));
    std::istringstream text(
        "interval_sim " + std::to_string(step) + "\n" +
        Room("position( name \"r\" pose [1 -2 0 30] alwayson 1 ranger( name \"l\" pose [0.05 0.02 "
             "0 5]"
             " alwayson 1 sensor( pose [0.05 0 0 10] range [0 20] fov 350 samples 36 ) ) )"));
    ASSERT_TRUE(original.Load(text));
    dynamic_cast<ModelPosition&>(*original.GetModel("r")).SetSpeed(0.5, 0, 1.2);
    Log(&original, kSteps, "run.mcap");

    recording::Replay replay(Path("run.mcap"));
    const std::unique_ptr<World> world = LoadFrom(replay);
    replay.Attach(world.get());
    const auto& ranger = dynamic_cast<ModelRanger&>(*world->GetModel("r.l"));
    Mapper shown;
    const auto look = [&] {
      const Pose frame = ranger.SensorFrame(ranger.GetScanPose());
      const ModelRanger::Sensor& sensor = ranger.GetSensors()[0];
      for (size_t i = 0; i < sensor.ranges.size(); i++)
        shown.Add(ModelRanger::OriginOf(sensor, frame, SinCos(frame.a)), sensor.bearings[i],
                  sensor.ranges[i]);
    };
    Run(world.get(), kSteps, look);
    for (const int i : {kSteps / 2, kSteps, 1}) {
      replay.SeekTo(world->sim_interval * static_cast<usec_t>(i));
      look();
    }
    shown.Print("replay, steps of " + std::to_string(step) + " ms");
    EXPECT_GT(shown.points(), 100u);
    EXPECT_LT(shown.Quantile(1), 1e-4);  // ranges are 32-bit floats
  }
}

TEST_F(ReplayTest, ShowsTheLoggedValuesOfFields) {
  World original(OptionsOf(1));
  std::istringstream text(
      "interval_sim 100\n"
      "field( name \"trail\" size [2 1 0] field_resolution 0.5 diffusion 0.01 evaporation 0.1 "
      "log_interval 300 )\n"
      "field( name \"secret\" initial 3 log_interval 0 )\n"
      "position( name \"ant\" pose [-0.9 0 0 0] size [0.2 0.2 0.1] alwayson 1\n"
      "  groundsensor( field \"trail\" deposit_rate 1 ) )");
  ASSERT_TRUE(original.Load(text));
  dynamic_cast<ModelPosition&>(*original.GetModel("ant")).SetSpeed(0.5, 0, 0);
  const auto& trail = dynamic_cast<const ModelField&>(*original.GetModel("trail"));
  std::vector<std::vector<double>> values;
  Log(&original, 30, "run.mcap", {}, [&] { values.push_back(trail.values()); });

  recording::Replay replay(Path("run.mcap"));
  const std::unique_ptr<World> world = LoadFrom(replay);
  replay.Attach(world.get());
  const auto& shown = dynamic_cast<const ModelField&>(*world->GetModel("trail"));
  for (size_t i = 0; i <= 30; i++) {
    EXPECT_EQ(shown.values(), values[i / 3 * 3]) << i;
    world->Update();
  }
  EXPECT_NE(values[9], values[12]);
  for (const size_t i : {11u, 4u, 30u, 0u}) {
    replay.SeekTo(100'000 * i);
    EXPECT_EQ(shown.values(), values[i / 3 * 3]) << i;
  }
}

TEST_F(ReplayTest, TruncatedLogEndsWithItsLastWholeChunk) {
  const std::string whole = LargeLog();
  const McapReader log(Path("large.mcap"));
  const auto& chunks = log.chunks();
  test::RandomSource random(7);
  std::vector<size_t> cuts = {0, 1, 8, 9, 30, whole.size() - 1, whole.size() - 8};
  for (const McapReader::Chunk& chunk : chunks)
    for (const uint64_t cut : {chunk.offset - 9, chunk.offset, chunk.offset + chunk.length - 1,
                               chunk.offset + chunk.length})
      cuts.push_back(static_cast<size_t>(cut));
  for (int i = 0; i < (kSanitized ? 10 : 40); i++)
    cuts.push_back(static_cast<size_t>(random.Next() % whole.size()));
  for (const size_t cut : cuts) {
    size_t expected = 0;
    for (const McapReader::Chunk& chunk : chunks) expected += chunk.offset + chunk.length <= cut;
    const std::string problem = ProblemOf(whole.substr(0, cut));
    if (expected == 0) {
      EXPECT_NE(problem, "") << cut;
      continue;
    }
    EXPECT_EQ(problem, "") << cut;
    EXPECT_EQ(McapReader(Path("damaged.mcap")).chunks().size(), expected) << cut;
  }
}

TEST_F(ReplayTest, DamagedLogsAreRefused) {
  const std::string whole = LargeLog();
  const McapReader log(Path("large.mcap"));
  for (const McapReader::Chunk& chunk : log.chunks()) {
    std::string bytes = whole;
    bytes[static_cast<size_t>(chunk.offset + chunk.length / 2)] ^= 0x10;
    EXPECT_NE(ProblemOf(bytes).find("is damaged"), std::string::npos);
    bytes = whole;
    bytes[static_cast<size_t>(chunk.offset + 24)] ^= 1;  // the checksum
    EXPECT_NE(ProblemOf(bytes).find("is damaged"), std::string::npos);
  }
  test::RandomSource random(11);
  for (int i = 0; i < (kSanitized ? 20 : 100); i++) {
    std::string bytes = whole;
    const size_t most = i % 2 == 0 ? bytes.size() / 100 : bytes.size();
    for (int k = 0; k < 3; k++)
      bytes[static_cast<size_t>(random.Next() % most)] = static_cast<char>(random.Next() % 256);
    ProblemOf(bytes);  // may fail, must not crash
  }
}

TEST_F(ReplayTest, OtherFilesAreRefused) {
  EXPECT_NE(ProblemOf("").find("expected an MCAP file"), std::string::npos);
  EXPECT_NE(ProblemOf("world( )").find("expected an MCAP file"), std::string::npos);
  {
    recording::McapWriter foreign(Path("foreign.mcap"), recording::Compression::kNone, "ros2", "x");
    foreign.Finish();
  }
  EXPECT_NE(ProblemOf(BytesOf(Path("foreign.mcap"))).find("found no world file"),
            std::string::npos);
  EXPECT_THROW(recording::Replay("/"), std::runtime_error);
  for (const char* name : {"../x", "/x", "a/../../x", ""}) {
    const std::vector<recording::WorldFile> files = {{name, "y"}};
    EXPECT_THROW(recording::UnpackedFiles{files}, std::runtime_error) << name;
  }
}

TEST_F(ReplayTest, FindsFilesOfOtherFolders) {
  std::filesystem::create_directories(folder_ / "w");
  std::filesystem::create_directories(folder_ / "i");
  WriteBytes(Path("i/a.inc"), "define post model( size [0.1 0.1 1] )\n");
  WriteBytes(Path("w/a.world"), "include \"../i/a.inc\"\npost( name \"p\" )\n");
  {
    const std::unique_ptr<World> world = LoadFile(Path("w/a.world"), 1);
    Log(world.get(), 3, "run.mcap");
  }
  std::filesystem::remove_all(folder_ / "i");
  std::filesystem::remove_all(folder_ / "w");
  recording::Replay replay(Path("run.mcap"));
  EXPECT_NE(LoadFrom(replay)->GetModel("p"), nullptr);
}

}  // namespace

}  // namespace log_testing
