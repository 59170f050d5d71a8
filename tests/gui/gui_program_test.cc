// SPDX-License-Identifier: GPL-2.0-or-later
//
// The `stage` program with its window, and on displays that can't open one.

#include "gui/gui_testing.hh"
#include "support/cli_testing.hh"

namespace gui_testing {

using namespace cli_testing;

namespace {

class ProgramTest : public CliTest {
 protected:
  static Environment OnDisplay() { return {{"DISPLAY", std::getenv("DISPLAY")}}; }
  /// Waits for a window with that title; 0: it does not appear in time.
  static unsigned long WaitForWindow(const std::string& title) {
    const double end = cli_testing::WallClock() + patience::kPatience;
    while (cli_testing::WallClock() < end) {
      if (const unsigned long window = TheHand().Find(title)) return window;
      Nap();
    }
    return 0;
  }
};

const char kSmall[] = "confirm_on_quit 0 window ( size [300 250] )";

TEST_F(ProgramTest, RunsInAWindowUntilItIsClosed) {
  WriteWorld("w.world", kSmall);
  Process stage(directory_, {"w.world", "--progress"}, OnDisplay());
  const unsigned long window = WaitForWindow("Stage: w.world");
  ASSERT_NE(window, 0u) << stage.err();
  TheHand().Close(window);
  const Result result = stage.Finish();
  EXPECT_EQ(result.status, 0);
  EXPECT_FALSE(result.hung);
  EXPECT_TRUE(Contains(result.err, "Stage: User closed window\n[Stage: done]\n")) << result.err;
  EXPECT_EQ(result.out, "");
}

TEST_F(ProgramTest, ExitOfTheMenu) {
  WriteWorld("w.world", kSmall);
  Process stage(directory_, {"w.world", "--progress"}, OnDisplay());
  const unsigned long window = WaitForWindow("Stage: w.world");
  ASSERT_NE(window, 0u) << stage.err();
  TheHand().Focus(window);
  TheHand().Type("q", {"Control_L"});
  const Result result = stage.Finish();
  EXPECT_EQ(result.status, 0);
  EXPECT_TRUE(Contains(result.err, "User exited via menu\n[Stage: done]\n")) << result.err;
}

TEST_F(ProgramTest, EndsWithItsDurationAsWithoutAWindow) {
  WriteRobots("w.world", std::string("speedup -1 ") + kSmall);
  const Strings options = {"w.world", "--duration", "20", "--state-hash"};
  const Result with = Stage(options, OnDisplay());
  Strings headless = options;
  headless.push_back("-g");
  const Result without = Stage(headless);
  const auto hash = [](const Result& r) { return r.out.substr(r.out.find("state-hash")); };
  EXPECT_EQ(with.status, 0) << with.err;
  EXPECT_EQ(hash(with), hash(without));
}

TEST_F(ProgramTest, SignalsEndItInOrder) {
  WriteWorld("w.world", std::string("paused 1 ") + kSmall);
  Process stage(directory_, {"w.world", "--progress"}, OnDisplay());
  ASSERT_NE(WaitForWindow("Stage: w.world"), 0u) << stage.err();
  stage.Send(SIGTERM);
  const Result result = stage.Finish();
  EXPECT_EQ(result.status, 128 + SIGTERM);
  EXPECT_TRUE(Contains(result.err, "[Stage: done]"));
}

TEST_F(ProgramTest, SeveralWorldsAreRefused) {
  WriteWorld("w.world", kSmall);
  const Result result = Stage({"w.world", "w.world"}, OnDisplay());
  EXPECT_EQ(result.status, 255);
  EXPECT_TRUE(Contains(result.err, "found 2 world files, expected one")) << result.err;
  EXPECT_FALSE(Contains(result.out, "Loading"));
}

TEST_F(ProgramTest, AWorldThatCannotBeLoadedEndsIt) {
  Write("w.world", "model(");
  const Result result = Stage({"w.world"}, OnDisplay());
  EXPECT_EQ(result.status, 1);
  EXPECT_TRUE(Contains(result.err, "w.world:1:")) << result.err;
}

TEST_F(ProgramTest, SaysThatADisplayCannotBeOpened) {
  WriteWorld("w.world", kSmall);
  const Result result = Stage({"w.world"}, {{"DISPLAY", ":4711"}});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(result.err, "stage: Can't open display: :4711\n");
}

TEST_F(ProgramTest, SaysThatADisplayHasNoOpenGl) {
  const XServer without_gl({"-extension", "GLX"});
  ASSERT_NE(without_gl.name(), "");
  WriteWorld("w.world", kSmall);
  const Result result = Stage({"w.world"}, {{"DISPLAY", without_gl.name()}});
  EXPECT_EQ(result.status, 1);
  EXPECT_EQ(result.err, "stage: the X display " + without_gl.name() +
                            " has no OpenGL (GLX), which the window needs; -g runs without a "
                            "window\n");
  EXPECT_EQ(Stage({"-g", "w.world", "--duration", "1"}, {{"DISPLAY", without_gl.name()}}).status,
            0);
}

}  // namespace

}  // namespace gui_testing
