// SPDX-License-Identifier: GPL-2.0-or-later
//
// Settings that override values of a world file, and populations.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "worldfile/worldfile_testing.hh"

namespace Stg {
namespace {

constexpr char kFile[] =
    "resolution 0.02\n"
    "define robot position( size [1 1 1] ctrl \"wander\" )\n"
    "define fast robot( speed 2 )\n"
    "robot( name \"a\" )\n"
    "fast( name \"b\" speed 3 model( tag 1 ) )\n"
    "model( name \"wall\" )\n"
    "population( name \"crowd\" model \"fast\" count 2 )\n";

void LoadWith(Worldfile* wf, const std::vector<std::string>& settings, const std::string& text) {
  wf->Set(settings);
  LoadText(*wf, text);
}

std::string ErrorWith(const std::string& setting, const std::string& text = kFile) {
  Worldfile wf;
  try {
    LoadWith(&wf, {setting}, text);
    wf.CheckSettings();
  } catch (const LoadError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

TEST(Settings, CanSelectWorldTypesMacrosAndModels) {
  Worldfile wf;
  LoadWith(&wf,
           {"world.resolution=0.5", "position.size=[2 3 4]", "robot.ctrl=follow me, please",
            "a.speed=7", "model.tag=9"},
           kFile);
  EXPECT_EQ(wf.ReadFloat(0, "resolution", 0), 0.5);
  EXPECT_EQ(wf.ReadElement(1, "size", 2), "4");
  EXPECT_EQ(wf.ReadString(2, "ctrl", ""), "follow me, please") << "a macro's macro";
  EXPECT_EQ(wf.ReadFloat(1, "speed", 0), 7) << "which the file doesn't give";
  EXPECT_EQ(wf.ReadFloat(2, "speed", 0), 3);
  EXPECT_EQ(wf.ReadInt(3, "tag", 0), 9);
  EXPECT_EQ(wf.ReadInt(4, "tag", 0), 9);
  wf.CheckSettings();
}

TEST(Settings, LastMatchingSettingWins) {
  Worldfile wf;
  LoadWith(&wf, {"robot.speed=5", "fast.speed=6", "b.speed=7", "robot.speed=8"}, kFile);
  EXPECT_EQ(wf.ReadFloat(1, "speed", 0), 8);
  EXPECT_EQ(wf.ReadFloat(2, "speed", 0), 8);
  wf.CheckSettings();
}

TEST(Settings, CanSelectSectionsByNumber) {
  Worldfile wf;
  LoadWith(&wf, {"robot.speed=5", "#2.speed=6", "#0.resolution=0.5", "#3.tag=9"}, kFile);
  EXPECT_EQ(wf.ReadFloat(1, "speed", 0), 5);
  EXPECT_EQ(wf.ReadFloat(2, "speed", 0), 6);
  EXPECT_EQ(wf.ReadFloat(0, "resolution", 0), 0.5);
  EXPECT_EQ(wf.ReadInt(3, "tag", 0), 9);
  EXPECT_EQ(wf.ReadInt(4, "tag", 0), 0);
  wf.CheckSettings();
  EXPECT_EQ(wf.Copy()->ReadFloat(2, "speed", 0), 6);
  EXPECT_NE(ErrorWith("#2.speeed=1").find("nothing reads \"speeed\" of \"#2\""), std::string::npos);
  for (const char* none : {"#99.speed=1", "#.speed=1", "#2x.speed=1", "#-1.speed=1"})
    EXPECT_NE(ErrorWith(none).find("found nothing in the world file that is called"),
              std::string::npos)
        << none;
}

TEST(Settings, AreCopiedButNotSaved) {
  Worldfile wf;
  LoadWith(&wf, {"world.resolution=0.5"}, kFile);
  EXPECT_EQ(wf.Copy()->ReadFloat(0, "resolution", 0), 0.5);
}

TEST(Settings, RejectInvalidSyntax) {
  for (const char* text : {"", "=", "robots", "a.b", "=1", ".b=1", "a.=1", "a.b="})
    EXPECT_NE(ErrorWith(text).find("expected NAME.PROPERTY=VALUE"), std::string::npos) << text;
  for (const char* text : {"a.b=[1", "a.b=[[1]]", "a.b=[1] 2", "a.b=[( )]", "a.b=one\"two"})
    EXPECT_EQ(ErrorWith(text).rfind("--set a.b:", 0), 0U) << text << ErrorWith(text);
}

TEST(Settings, RejectUnusedSettings) {
  EXPECT_NE(ErrorWith("a.speeed=1").find("nothing reads \"speeed\" of \"a\""), std::string::npos);
  EXPECT_NE(ErrorWith("robt.speed=1").find("did you mean \"robot\"?"), std::string::npos);
}

// ---- populations --------------------------------------------------------------------------------

TEST(Populations, EqualExplicitModels) {
  Worldfile wf;
  LoadText(wf, kFile);
  EXPECT_EQ(Tree(wf), "position:0 position:0 model:2 model:0 population:0 position:0 position:0");
  ASSERT_EQ(wf.populations().size(), 1U);
  EXPECT_EQ(wf.populations()[0].members, (std::vector<int>{6, 7}));
  EXPECT_EQ(wf.ReadString(6, "name", ""), "crowd0");
  EXPECT_EQ(wf.ReadFloat(7, "speed", 0), 2) << "of the macro";
}

TEST(Populations, ObeyTheCountOfASetting) {
  Worldfile wf;
  LoadWith(&wf, {"crowd=0"}, kFile);
  EXPECT_TRUE(wf.populations()[0].members.empty());
  LoadWith(&wf, {"crowd.count=5"}, kFile);
  EXPECT_EQ(wf.populations()[0].members.size(), 5U);
}

TEST(Populations, SettingReplacesModelsOfTheFile) {
  for (const char* name : {"robot=3", "robots=3"}) {
    Worldfile wf;
    LoadWith(&wf, {name}, kFile);
    EXPECT_EQ(Tree(wf),
              "position:0 model:1 model:0 population:0 position:0 position:0 position:0 "
              "position:0 position:0")
        << "without the only one that is written as a robot";
    EXPECT_EQ(wf.ReadString(5, "name", ""), "robot0");
    EXPECT_EQ(wf.populations().size(), 2U);
  }
}

TEST(Populations, RejectInvalidPopulations) {
  EXPECT_NE(ErrorWith("dogs=3").find("found no population and no model of that name"),
            std::string::npos);
  for (const char* count : {"-1", "2.5", "many", "100001"})
    EXPECT_NE(ErrorWith(std::string("crowd=") + count).find("a whole number, from 0 to 100000"),
              std::string::npos)
        << count;
  EXPECT_ERROR("population( count 3 )", "t.world:1:1", "without a model");
  EXPECT_ERROR("population( model \"population\" )", "t.world:1:", "a population of populations");
  EXPECT_ERROR("model( population( model \"model\" ) )", "t.world:1:8", "outside of all models");
}

}  // namespace
}  // namespace Stg
