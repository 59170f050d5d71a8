// SPDX-License-Identifier: GPL-2.0-or-later
//
// Escaping of names in messages, and log sinks.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "stage.hh"
#include "support/model_testing.hh"
#include "support/odd_names.hh"

using namespace Stg;
using odd_names::kEvil;
using odd_names::WhyUnfit;

namespace {

// ---- Printable() --------------------------------------------------------------------------------

TEST(Printable, TextStaysAsItIs) {
  for (const char* text :
       {"", "pose", " a \"b\" \\ ~", "M\xc3\xbchle", "\xe2\x82\xac \xf0\x9f\xa4\x96"})
    EXPECT_EQ(Printable(text), text);
}

TEST(Printable, EscapesControlCharacters) {
  const std::pair<std::string, std::string> kCases[] = {
      {"\x1b[31mred", "\\x1b[31mred"},
      {"a\nb\rc\td", "a\\nb\\rc\\td"},
      {"\a\b\x7f", "\\x07\\x08\\x7f"},
      {std::string("\0x", 2), "\\x00x"},
      {"\x9b"
       "31m",
       "\\x9b31m"},  // CSI of ISO 8859
      {"\xc2\x9b"
       "31m",
       "\\xc2\\x9b31m"},  // CSI of Unicode
      {"\xe2\x80\xae"
       "dcba",
       "\\xe2\\x80\\xae"
       "dcba"},                             // right-to-left override
      {"\xe2\x80\xa8", "\\xe2\\x80\\xa8"},  // line separator
      {"M\xfchle", "M\\xfchle"},            // ISO 8859
      {"\xc0\x9b", "\\xc0\\x9b"},           // overlong
      {"\xe0\x82\x9b", "\\xe0\\x82\\x9b"},
      {"\xed\xa0\x80", "\\xed\\xa0\\x80"},           // a surrogate
      {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"},  // beyond Unicode
      {"a\xe2\x82", "a\\xe2\\x82"}};                 // truncated
  for (const auto& [text, shown] : kCases) {
    EXPECT_EQ(Printable(text), shown);
    EXPECT_EQ(Printable(shown), shown);
  }
}

TEST(Printable, EveryByteAndEveryPair) {
  for (int a = 0; a < 256; a++)
    for (int b = 0; b < 256; b++) {
      const std::string text = {static_cast<char>(a), static_cast<char>(b)};
      ASSERT_EQ(WhyUnfit(Printable(text), 100, ""), "") << a << " " << b;
      ASSERT_EQ(Printable(Printable(text)), Printable(text));
    }
}

TEST(Printable, LongNamesLoseTheirMiddle) {
  const std::string name = "first" + std::string(100000, 'x') + "last";
  const std::string shown = Printable(name, 80);
  EXPECT_EQ(shown.size(), 80u);
  EXPECT_EQ(shown.substr(0, 6), "firstx");
  EXPECT_EQ(shown.substr(74), "xxlast");
  EXPECT_NE(shown.find("x...x"), std::string::npos);
  EXPECT_EQ(Printable(shown, 80), shown);
  for (std::size_t longest = 0; longest < 40; longest++) {
    std::string euros = "\xe2\x82\xac";
    for (int i = 0; i < 5; i++) euros += euros;
    const std::string cut = Printable(euros, longest);
    EXPECT_EQ(WhyUnfit(cut, std::max<std::size_t>(longest, 3), ""), "") << longest;
    EXPECT_EQ(cut, Printable(cut)) << "a character was cut in two";
  }
}

TEST(Printable, LoadErrorsAre) {
  EXPECT_STREQ(LoadError("a\x1b"
                         "b\n")
                   .what(),
               "a\\x1b"
               "b\\n");
  EXPECT_EQ(messages::PrintableLines("a\nb\x1b\n\nc"), "a\nb\\x1b\n\nc");
}

// ---- the sink -----------------------------------------------------------------------------------

class Sink : public testing::Test {
 protected:
  void SetUp() override {
    SetLogSink([this](LogLevel level, const std::string& line) {
      if (level != LogLevel::kProgress) lines_.emplace_back(level, line);
    });
  }
  void TearDown() override { SetLogSink(nullptr); }

  std::vector<std::pair<LogLevel, std::string>> lines_;
};

TEST_F(Sink, GetsMessagesForStandardError) {
  const auto world = EmptyWorld();
  const std::string errors = ErrorsOf([&] {
    EXPECT_EQ(world->GetModel("nobody\a"), nullptr);
    std::istringstream text("model( mass ) ");
    OutputOf([&] { EXPECT_FALSE(world->Load(text, "t.world")); });
  });
  EXPECT_EQ(errors, "");
  ASSERT_EQ(lines_.size(), 2u);
  EXPECT_EQ(lines_[0].first, LogLevel::kWarning);
  EXPECT_EQ(lines_[0].second, "stage: warning: there is no model called \"nobody\\x07\"");
  EXPECT_EQ(lines_[1].first, LogLevel::kError);
  EXPECT_EQ(lines_[1].second.substr(0, 13), "t.world:1:13:");

  SetLogSink(nullptr);
  EXPECT_EQ(ErrorsOf([&] { world->GetModel("nobody"); }),
            "stage: warning: there is no model called \"nobody\"\n");
}

TEST_F(Sink, MayReportItself) {
  int depth = 0;
  SetLogSink([&](LogLevel, const std::string&) {
    if (++depth < 3) messages::Warn("again");
  });
  messages::Warn("once");
  EXPECT_EQ(depth, 3);
}

// ---- calls with unusual names -------------------------------------------------------------------

/// Creates models with the name and makes invalid calls, each of which logs a message with it.
void CallWrongly(World* world, const std::string& name) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto* robot = dynamic_cast<ModelPosition*>(world->CreateModel(nullptr, "position"));
  Model* child = world->CreateModel(robot, "ranger");
  robot->SetToken(name);
  child->SetToken(name + "2");
  robot->SetPose(Pose(nan, 0, 0, 0));
  robot->SetGeom(Geom(Pose(), Size(nan, 1, 1)));
  robot->SetSpeed(nan, 0, 0);
  robot->SetToken("");
  robot->Unsubscribe();
  robot->SetParent(child);
  robot->GetUnusedModelOfType(name);
  robot->LoadControllerModule(name.c_str());
  world->GetModel(name);
  world->CreateModel(robot, name);
}

TEST(OddNames, InWhatTheLibraryReports) {
  for (const std::string& name : {kEvil, std::string(100000, 'x')}) {
    const auto world = EmptyWorld();
    std::string errors;
    EXPECT_EQ(OutputOf([&] { errors = ErrorsOf([&] { CallWrongly(world.get(), name); }); }), "");
    EXPECT_EQ(WhyUnfit(errors, 420, "\n"), "") << errors;
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 9) << errors;
  }
}

TEST(OddNames, InWhatModelsPrint) {
  for (const char* type : {"model", "position", "ranger", "bumper"}) {
    const auto world = EmptyWorld();
    Model* model = world->CreateModel(nullptr, type);
    model->SetToken(kEvil);
    char prefix[] = "> ";
    const std::string text = OutputOf([&] { model->Print(prefix); });
    EXPECT_EQ(WhyUnfit(text, 1000, "\n"), "") << text;
    EXPECT_NE(text.find(Printable(kEvil)), std::string::npos) << text;
  }
}

TEST(OddNames, InTheMacrosOfControllers) {
  // NOLINTNEXTLINE(bugprone-lambda-function-name)
  const std::string errors = ErrorsOf([&] { PRINT_ERR1("%s", kEvil.c_str()); });
  EXPECT_NE(errors.find(": " + Printable(kEvil) + " ("), std::string::npos) << errors;
  const std::string output = OutputOf([&] { PRINT_MSG2("two\nlines %d%% %s", 5, kEvil.c_str()); });
  EXPECT_EQ(output, "Stage: two\nlines 5% " + Printable(kEvil) + "\n");
}

// ---- ErrorTrap ----------------------------------------------------------------------------------

TEST(ErrorTrap, ErrorsAreKeptFromTheSinkAndWarningsAreNot) {
  const std::string printed = ErrorsOf([] {
    messages::Collector collector;
    const messages::ErrorTrap outer;
    {
      const messages::ErrorTrap inner;
      messages::Report(LogLevel::kError, "first");
      messages::Report(LogLevel::kError, "second");
      messages::Report(LogLevel::kWarning, "a warning");
      EXPECT_EQ(inner.Last("none"), "second");
    }
    EXPECT_EQ(outer.Last("none"), "none");
    EXPECT_EQ(collector.lines, (std::vector<std::string>{"first", "second", "a warning"}));
  });
  EXPECT_EQ(printed, "a warning\n");
}

}  // namespace
