// SPDX-License-Identifier: GPL-2.0-or-later
//
// `stage --screenshot` and `--record`: pictures of the worlds that come with Stage, compared with
// those in tests/data/pictures. As fonts and drivers differ between machines, means of squares of
// pixels are compared. STAGE_NEW_PICTURES=1 rewrites the files; check each before committing it.

#include <gtest/gtest.h>
#include <png.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "gui/offscreen/context.hh"

namespace Stg::offscreen {

namespace {

namespace fs = std::filesystem;

const char* Environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}
std::string Source() { return Environment("STAGE_SOURCE_DIR"); }

/// Reason why this machine can't make pictures; empty if it can.
std::string NoPictures() {
  std::string error;
  return Context::Make(16, 16, &error) ? "" : error;
}

struct Outcome {
  int status;
  std::string errors;
};

/// Runs the program in a folder; `prefix`: shell words before it, such as variables.
Outcome Stage(const fs::path& folder, const std::string& arguments,
              const std::string& prefix = "") {
  const fs::path errors = folder / "errors.txt";
  const std::string command = "cd '" + folder.string() + "' && " + prefix + " '" +
                              Environment("STAGE_BINARY_DIR") + "/bin/stage' " + arguments +
                              " >output.txt 2>'" + errors.string() + "'";
  const int status = std::system(command.c_str());
  std::ifstream in(errors);
  return {WEXITSTATUS(status), std::string(std::istreambuf_iterator<char>(in), {})};
}

Image Read(const fs::path& file) {
  Image image;
  png_image header;
  std::memset(&header, 0, sizeof header);
  header.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&header, file.c_str())) {
    ADD_FAILURE() << file << ": " << header.message;
    return image;
  }
  header.format = PNG_FORMAT_RGBA;
  image.width = static_cast<int>(header.width);
  image.height = static_cast<int>(header.height);
  image.pixels.resize(PNG_IMAGE_SIZE(header));
  png_image_finish_read(&header, nullptr, image.pixels.data(), 0, nullptr);
  return image;
}

/// Fraction of squares of 5 x 5 pixels whose mean colours differ by more than a tenth.
double Difference(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) return 1;
  constexpr int kSide = 5;
  int squares = 0, different = 0;
  for (int y = 0; y + kSide <= a.height; y += kSide)
    for (int x = 0; x + kSide <= a.width; x += kSide) {
      int sums[3] = {0, 0, 0};
      for (int i = 0; i < kSide * kSide; i++) {
        const auto pixel = static_cast<size_t>((y + i / kSide) * a.width + x + i % kSide) * 4;
        for (size_t c = 0; c < 3; c++) sums[c] += a.pixels[pixel + c] - b.pixels[pixel + c];
      }
      squares++;
      for (const int sum : sums)
        if (std::abs(sum) > 25 * kSide * kSide) {
          different++;
          break;
        }
    }
  return static_cast<double>(different) / squares;
}
constexpr double kTolerance = 0.015;

class PicturesTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("stage-pictures-" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const std::string why = NoPictures();
    if (!why.empty()) GTEST_SKIP() << why;
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Quoted path of a shipped world file.
  std::string World(const std::string& name) { return "'" + Source() + "/worlds/" + name + "'"; }
  void WriteWorld(const std::string& text) { std::ofstream(folder_ / "t.world") << text; }

  fs::path folder_;
};

struct Example {
  const char* name;
  const char* world;
  const char* arguments;
};

class WorldPicturesTest : public PicturesTest, public testing::WithParamInterface<Example> {};

TEST_P(WorldPicturesTest, MatchesStoredPicture) {
  const Example& example = GetParam();
  const fs::path made = folder_ / "made.png";
  const Outcome outcome = Stage(folder_, "--screenshot made.png" + std::string(example.arguments) +
                                             " '" + Source() + "/" + example.world + "'");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const fs::path kept = Source() + "/tests/data/pictures/" + example.name + ".png";
  if (*Environment("STAGE_NEW_PICTURES")) {
    fs::create_directories(kept.parent_path());
    fs::copy_file(made, kept, fs::copy_options::overwrite_existing);
    GTEST_SKIP() << "written anew: " << kept;
  }
  const double difference = Difference(Read(made), Read(kept));
  if (difference > kTolerance)
    fs::copy_file(made,
                  fs::path(Environment("STAGE_BINARY_DIR")) / (std::string(example.name) + ".png"),
                  fs::copy_options::overwrite_existing);
  EXPECT_LE(difference, kTolerance) << "see " << example.name << ".png in the build folder";
}

INSTANTIATE_TEST_SUITE_P(
    Worlds, WorldPicturesTest,
    testing::Values(Example{"simple", "worlds/simple.world", "@5 --size 320x320"},
                    Example{"zoo", "worlds/zoo.world", "@4 --size 400x300"},
                    Example{"foraging", "worlds/foraging.world", "@30 --size 320x320"},
                    Example{"cave", "worlds/cave.world", "@2 --size 320x320"},
                    Example{"hospital", "worlds/hospital.world", "@0 --size 480x220"},
                    Example{"views", "tests/data/pictures/views.world", "@6 --size 400x300"},
                    Example{"perspective", "tests/data/pictures/perspective.world",
                            "@6 --size 400x300"},
                    Example{"rays", "tests/data/pictures/rays.world", "@1 --size 400x300"},
                    Example{"cells", "tests/data/pictures/cells.world", "@1 --size 400x300"}),
    [](const auto& example) { return std::string(example.param.name); });

TEST_F(PicturesTest, ComparisonDetectsMissingParts) {
  const Outcome shown =
      Stage(folder_, "--screenshot a.png@5 --size 320x320 " + World("simple.world"));
  ASSERT_EQ(shown.status, 0) << shown.errors;
  ASSERT_EQ(Stage(folder_, "--screenshot b.png@12 --size 320x320 " + World("simple.world")).status,
            0);
  EXPECT_GT(Difference(Read(folder_ / "a.png"), Read(folder_ / "b.png")), 2 * kTolerance);
}

TEST_F(PicturesTest, AreReproducible) {
  for (const char* name : {"a.png@3", "b.png@3"})
    ASSERT_EQ(Stage(folder_, std::string("--screenshot ") + name + " --size 200x150 " +
                                 World("simple.world"))
                  .status,
              0);
  EXPECT_EQ(Difference(Read(folder_ / "a.png"), Read(folder_ / "b.png")), 0);
}

TEST_F(PicturesTest, DoNotChangeTheRun) {
  const auto hash = [this](const std::string& options) {
    const std::string arguments = options + " --state-hash --duration 3 " + World("simple.world");
    EXPECT_EQ(Stage(folder_, arguments).status, 0);
    std::ifstream in(folder_ / "output.txt");
    const std::string text(std::istreambuf_iterator<char>(in), {});
    const size_t at = text.find("state-hash");
    return at == std::string::npos ? "none" : text.substr(at);
  };
  const std::string plain = hash("-g");
  EXPECT_NE(plain, "none");
  EXPECT_EQ(hash("--record film --size 64x64 --screenshot a.png"), plain);
}

TEST_F(PicturesTest, SeveralShotsEndTheRun) {
  WriteWorld("window ( size [300 230] ) model ()");
  const Outcome outcome =
      Stage(folder_, "--screenshot a.png@0 --screenshot b.png@0.35 --screenshot c.png t.world");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  for (const char* name : {"a.png", "b.png", "c.png"}) {
    const Image image = Read(folder_ / name);
    EXPECT_EQ(image.width, 300);
    EXPECT_EQ(image.height, 200);  // without the menu bar
  }
}

TEST_F(PicturesTest, AFilmHasAFrameForEachStep) {
  WriteWorld("model ()");
  ASSERT_EQ(Stage(folder_, "--record film --size 64x48 --duration 1 t.world").status, 0);
  int frames = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "film"))
    frames += entry.path().extension() == ".png";
  EXPECT_EQ(frames, 11);  // one before the first step and one after each
  EXPECT_TRUE(fs::exists(folder_ / "film/stage-000010.png"));
}

TEST_F(PicturesTest, AFilmHas25FramesASecondAtMost) {
  WriteWorld("interval_sim 1 model ()");
  ASSERT_EQ(Stage(folder_, "--record film --size 16x16 --duration 1 t.world").status, 0);
  size_t frames = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "film"))
    frames += entry.path().extension() == ".png";
  EXPECT_EQ(frames, 26u);
}

// ---- videos -------------------------------------------------------------------------------------

/// Replaces ffmpeg by a shell script in a folder at the start of PATH.
class VideoTest : public PicturesTest {
 protected:
  void SetUp() override {
    PicturesTest::SetUp();
    fs::create_directories(folder_ / "bin");
    WriteWorld("interval_sim 50 model ()");
  }
  void WriteFfmpeg(const std::string& script) {
    std::ofstream(folder_ / "bin/ffmpeg") << "#!/bin/sh\n" << script;
    fs::permissions(folder_ / "bin/ffmpeg", fs::perms::owner_all);
  }
  Outcome Record(const std::string& arguments) {
    return Stage(folder_, arguments + " --size 31x20 t.world",
                 "PATH='" + (folder_ / "bin").string() + "':/usr/bin:/bin");
  }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      if (entry.path().extension() == ".mp4") names.push_back(entry.path().filename());
    return names;
  }
};

TEST_F(VideoTest, FramesGoThroughFfmpeg) {
  WriteFfmpeg("for last; do :; done; echo \"$@\" > arguments; cat > \"${last#file:}\"\n");
  const Outcome outcome = Record("--record 'a film.mp4' --duration 1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_EQ(Files(), std::vector<std::string>{"a film.mp4"});
  EXPECT_EQ(fs::file_size(folder_ / "a film.mp4"),
            21u * 31 * 20 * 4);  // 21 pictures, one before the first step
  std::ifstream in(folder_ / "arguments");
  const std::string arguments(std::istreambuf_iterator<char>(in), {});
  EXPECT_NE(arguments.find("-s 31x20 -r 20 "), std::string::npos) << arguments;
  EXPECT_NE(arguments.find("yuv420p"), std::string::npos) << arguments;
}

TEST_F(VideoTest, ReportsErrorsOfFfmpeg) {
  WriteFfmpeg("echo 'first line' >&2; echo 'no such codec' >&2; exit 1\n");
  const Outcome outcome = Record("--record a.mp4 --duration 30");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.errors.find("a.mp4 can't be written: ffmpeg: no such codec\n"),
            std::string::npos)
      << outcome.errors;
  EXPECT_TRUE(Files().empty());
}

TEST_F(VideoTest, SuggestsInstallingFfmpeg) {
  const Outcome outcome = Stage(folder_, "--record a.MP4 t.world", "PATH=/nowhere");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.errors.find("a.MP4 needs the program ffmpeg, which is not on PATH: install"),
            std::string::npos)
      << outcome.errors;
  EXPECT_TRUE(Files().empty());
}

TEST_F(VideoTest, DoesNotOverwriteOtherFiles) {
  WriteFfmpeg("for last; do :; done; cat > \"${last#file:}\"\n");
  std::ofstream(folder_ / "a.mp4") << "mine";
  const Outcome outcome = Record("--record a.mp4 --duration 1");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.errors.find("a.mp4 exists, expected a new name"), std::string::npos);
  EXPECT_EQ(fs::file_size(folder_ / "a.mp4"), 4u);
  const Outcome nowhere = Record("--record no/a.mp4 --duration 1");
  EXPECT_EQ(nowhere.status, 2);
  EXPECT_NE(nowhere.errors.find("no/a.mp4 can't be written: No such file"), std::string::npos);
}

/// After Ctrl-C the film contains the run so far. The script interrupts the program, its parent, as
/// soon as it has received the first bytes of a picture.
TEST_F(VideoTest, InterruptedRunLeavesAFilm) {
  WriteFfmpeg(
      "for last; do :; done; f=\"${last#file:}\"; head -c 9 > \"$f\"; kill -INT $PPID; cat >> "
      "\"$f\"\n");
  const Outcome outcome = Stage(folder_, "--record a.mp4 --size 31x20 t.world",
                                "PATH='" + (folder_ / "bin").string() + "':/usr/bin:/bin");
  EXPECT_EQ(outcome.status, 128 + SIGINT) << outcome.errors;
  EXPECT_EQ(Files(), std::vector<std::string>{"a.mp4"});
}

/// The output file is created with the first frame, so a program that ends while the world is
/// loaded leaves none. The controller kills it in Init(), where nothing can be caught.
TEST_F(VideoTest, ARunThatEndsWhileItLoadsLeavesNoFile) {
  WriteFfmpeg("for last; do :; done; cat > \"${last#file:}\"\n");
  WriteWorld("interval_sim 50 model ( ctrl \"" + std::string(Environment("STAGE_BINARY_DIR")) +
             "/tests/plugins/nasty.so kill load\" )");
  const Outcome outcome =
      Stage(folder_, "--record a.mp4 --duration 1 --size 31x20 t.world",
            "STAGE_NASTY=1 PATH='" + (folder_ / "bin").string() + "':/usr/bin:/bin");
  EXPECT_EQ(outcome.status, 128 + SIGKILL) << outcome.errors;
  EXPECT_TRUE(Files().empty());
}

/// Runs with the real ffmpeg where it is installed.
TEST_F(VideoTest, RealFfmpegMakesAVideo) {
  if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) GTEST_SKIP() << "there is no ffmpeg";
  const Outcome outcome = Record("--record a.mp4 --duration 1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const std::string command = "cd '" + folder_.string() +
                              "' && ffmpeg -loglevel error -i a.mp4 -f rawvideo -pix_fmt rgb24 raw";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(fs::file_size(folder_ / "raw"), 21u * 32 * 20 * 3);  // sides rounded up to even numbers
}

// ---- errors -------------------------------------------------------------------------------------

void ExpectOneLine(const Outcome& outcome, int status, const std::string& part) {
  EXPECT_EQ(outcome.status, status);
  EXPECT_NE(outcome.errors.find(part), std::string::npos) << outcome.errors;
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
}

TEST_F(PicturesTest, ReportsMistakesInOneLine) {
  WriteWorld("model ()");
  constexpr int kUsage = 2;
  ExpectOneLine(Stage(folder_, "--screenshot a.jpg t.world"), kUsage,
                "found 'a.jpg', expected FILE.png");
  ExpectOneLine(Stage(folder_, "--screenshot a.png@-1 t.world"), kUsage,
                "expected simulated seconds");
  ExpectOneLine(Stage(folder_, "--screenshot no/a.png t.world"), kUsage,
                "no/a.png can't be written");
  ExpectOneLine(Stage(folder_, "--size 20 t.world"), kUsage, "expected WIDTHxHEIGHT");
  ExpectOneLine(Stage(folder_, "--size 20x20 t.world"), kUsage, "--size is for");
  ExpectOneLine(Stage(folder_, "--screenshot a.png@5 --duration 2 t.world"), kUsage,
                "within the --duration");
  ExpectOneLine(Stage(folder_, "--screenshot a.png t.world t.world"), kUsage, "expected one");
  ExpectOneLine(Stage(folder_, "--record output.txt t.world"), kUsage, "is not a folder");
  fs::create_directories(folder_ / "film");
  std::ofstream(folder_ / "film/stage-000007.png") << "mine";
  ExpectOneLine(Stage(folder_, "--record film t.world"), kUsage, "stage-000007.png exists");
}

TEST_F(PicturesTest, ARunThatEndsTooSoonIsAFailure) {
  std::ofstream(folder_ / "t.world") << "quit_time 0.5 model ()";
  const Outcome outcome =
      Stage(folder_, "--screenshot a.png@0.2 --record film --size 16x16 t.world");
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  ExpectOneLine(Stage(folder_, "--screenshot a.png@2 --record film2 --size 16x16 t.world"), 1,
                "a.png was not made: the run ended after 0.5 s");
}

/// A limit on file sizes simulates a full disk: writing starts, then fails.
TEST_F(PicturesTest, FailedPictureLeavesNoFile) {
  Image image{100, 100, std::vector<uint8_t>(40000)};
  uint32_t noise = 1;
  for (uint8_t& byte : image.pixels) byte = static_cast<uint8_t>((noise *= 1664525u) >> 24);
  const std::string file = (folder_ / "a.png").string();
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit little{5000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &little), 0);
  const int problem = WritePng(file, image, IfExists::kReplace);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(PngProblem(file, problem), file + " can't be written: " + std::strerror(EFBIG));
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_EQ(WritePng(file, image, IfExists::kReplace), 0);
}

}  // namespace

}  // namespace Stg::offscreen
