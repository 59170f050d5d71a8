// SPDX-License-Identifier: GPL-2.0-or-later
//
// Saving world files, and the report of unused properties.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <thread>

#include "geometry/geometry.hh"
#include "random/random.hh"
#include "worldfile/worldfile.hh"

namespace Stg {
namespace {

class SaveTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    root_ = std::filesystem::temp_directory_path() /
            (std::string("stage_save_") + info->name() + std::to_string(getpid()));
    std::filesystem::create_directories(root_);
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  std::string Path(const std::string& name) { return (root_ / name).string(); }
  void Write(const std::string& name, const std::string& text) {
    std::ofstream(Path(name), std::ios::binary) << text;
  }
  std::string Read(const std::string& name) {
    std::ifstream in(Path(name), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  }
  void Load(const std::string& text) {
    Write("w.world", text);
    wf_.Load(Path("w.world"));
  }
  std::string Saved() {
    EXPECT_TRUE(wf_.Save(""));
    return Read("w.world");
  }
  void WritePose(int entity, double x, double y, double z, double a) {
    Pose(x, y, z, a).Save(&wf_, entity, "pose");
  }

  std::filesystem::path root_;
  Worldfile wf_;
};

TEST_F(SaveTest, UnchangedTextIsPreserved) {
  const std::string text = "# c \"\n\tname  \"w\" m ( a [ 1 2 ] )#x\n\n  b 3 ";
  Load(text);
  EXPECT_EQ(Saved(), text);
}

TEST_F(SaveTest, ValuesAreReplacedInPlace) {
  Load("m( pose [ 1 2  0 90 7 ] # here\n f 0.5 s \"x\" i 3 q \"1\" )\n");
  WritePose(1, 1.5, -2, 0.1234567, -1.5707963267948966);
  wf_.WriteFloat(1, "f", 0.25);
  wf_.WriteString(1, "s", "a\"b\nc");
  wf_.WriteInt(1, "i", -4);
  wf_.WriteFloat(1, "q", 1);
  wf_.WriteFloat(1, "absent", 1);
  EXPECT_EQ(Saved(),
            "m( pose [ 1.5 -2  0.1234567 -90 7 ] # here\n"
            " f 0.25 s \"a'b c\" i -4 q \"1\" )\n");
  EXPECT_EQ(wf_.ReadFloat(1, "f", 0), 0.25);
}

// Positions are saved with all digits. Headings are saved as the degrees that were set, although
// models store radians.
TEST_F(SaveTest, NumbersHaveAllSignificantDigits) {
  Load("m( pose [ 1.0 2.50 0 45.000 ] )\n");
  WritePose(1, 1, 2.5, 0, 45 * wf_.unit_angle);
  EXPECT_EQ(Saved(), "m( pose [ 1.0 2.50 0 45.000 ] )\n");  // nothing has changed
  WritePose(1, 1.0 / 3, 12345678, 0.000001, 156.7 * wf_.unit_angle);
  EXPECT_EQ(Saved(), "m( pose [ 0.3333333333333333 12345678 0.000001 156.7 ] )\n");
  RandomStream random(3);
  for (int i = -1800; i < 1800; i += 37) {
    const double degrees = i / 10.0, x = random.Uniform();
    WritePose(1, x, 0, 0, degrees * wf_.unit_angle);
    const std::string text = Saved();
    std::ostringstream heading;
    heading << " 0 " << degrees << " ] )\n";
    EXPECT_TRUE(text.ends_with(heading.str())) << text << degrees;
    Worldfile again;
    again.Load(Path("w.world"));
    Pose pose;
    pose.Load(&again, 1, "pose");
    EXPECT_EQ(pose.x, x);
    EXPECT_EQ(pose.a, degrees * wf_.unit_angle);
  }
}

TEST_F(SaveTest, NumberFormats) {
  Load("a 1 b 1 c [1 1] d 1 e 1 f \"x\" g 1");
  wf_.WriteFloat(0, "a", 1e-9);
  wf_.WriteFloat(0, "b", 0.0004);
  wf_.WriteTuple(0, "c", 0, 2, "fu", -1e-9, 7U);
  wf_.WriteFloat(0, "d", std::numeric_limits<double>::quiet_NaN());
  wf_.WriteFloat(0, "e", 1e15);
  wf_.WriteTuple(0, "f", 0, 1, "s", "y");
  wf_.WriteString(0, "g", "word");
  wf_.WriteTuple(0, "c", 2, 1, "f", 5.0);  // the tuple has no such element
  EXPECT_EQ(Saved(), "a 1e-09 b 0.0004 c [-1e-09 7] d 1 e 1e+15 f \"y\" g \"word\"");
  EXPECT_EQ(wf_.warnings().size(), 1U);
}

TEST_F(SaveTest, UsesTheUnitsOfTheFile) {
  Load("unit_length \"cm\" unit_angle \"radians\" l 1 m( pose [1 1 1 1] size [1 1 1] )");
  WritePose(1, 0.5, 0, 0, 7.0);
  Size(1, 2, 3).Save(&wf_, 1, "size");
  wf_.WriteLength(0, "l", 0.25);
  EXPECT_EQ(Saved(),
            "unit_length \"cm\" unit_angle \"radians\" l 25 m( pose [50 0 0 "
            "0.7168146928204138] size [100 200 300] )");
}

TEST_F(SaveTest, RoundTripGivesTheSameNumbers) {
  Load("m( pose [0 0 0 0] )");
  const double x = 12.34567891234, a = 1.23456789;
  WritePose(1, x, 0, 0, a);
  ASSERT_TRUE(wf_.Save(""));
  Worldfile again;
  again.Load(Path("w.world"));
  Pose pose;
  pose.Load(&again, 1, "pose");
  EXPECT_EQ(pose.x, x);
  EXPECT_NEAR(pose.a, a, 3e-16);  // degrees in the file
}

TEST_F(SaveTest, LineEndsBecomeLf) {
  Load("a 1\r\nb 2\rc 3\n");
  wf_.WriteInt(0, "c", 4);
  EXPECT_EQ(Saved(), "a 1\nb 2\nc 4\n");
}

TEST_F(SaveTest, IncludesAreNotWritten) {
  Write("i.inc", "x 1\nm( pose [0 0 0 0] )\n");
  Load("include \"i.inc\" # dropped\ny 2 # kept\n");
  wf_.WriteInt(0, "x", 5);
  wf_.WriteInt(0, "y", 6);
  WritePose(1, 1, 1, 1, 1);
  EXPECT_EQ(Saved(), "include \"i.inc\"\ny 6 # kept\n");
  EXPECT_EQ(Read("i.inc"), "x 1\nm( pose [0 0 0 0] )\n");
  EXPECT_EQ(wf_.ReadInt(0, "x", 0), 5);
}

TEST_F(SaveTest, InstancesOverrideTheirMacro) {
  Load(
      "define r position( pose [0 0 0 0] size [1 1 1] )\n"
      "r( name \"a\" )\nr(\n  name \"b\"\n)\nr( name \"c\" )r()\n");
  for (int entity = 1; entity <= 4; ++entity) Size(1, 1, 1).Save(&wf_, entity, "size");
  WritePose(1, 1, 0, 0, 0);
  WritePose(2, 2, 0, 0, 0);
  WritePose(3, 0, 0, 0, 0);
  WritePose(4, 4, 0, 0, 0);
  Size(2, 2, 2).Save(&wf_, 4, "size");
  const std::string saved = Saved();
  EXPECT_EQ(saved,
            "define r position( pose [0 0 0 0] size [1 1 1] )\n"
            "r( name \"a\"  pose [1 0 0 0] )\nr(\n  name \"b\"\n"
            "  pose [2 0 0 0]\n)\nr( name \"c\" )"
            "r( pose [4 0 0 0]  size [2 2 2] )\n");
  Worldfile again;
  again.Load(Path("w.world"));
  Pose pose;
  EXPECT_EQ(pose.Load(&again, 2, "pose").x, 2);
  EXPECT_EQ(pose.Load(&again, 3, "pose").x, 0);
  EXPECT_EQ(pose.Load(&again, 4, "pose").x, 4);
}

TEST_F(SaveTest, ChildrenOfMacros) {
  const std::string text = "define r position( ranger( pose [0 0 0 0] ) )\nr()\nr()\n";
  Load(text);
  WritePose(2, 1, 0, 0, 0);
  WritePose(4, 0, 0, 0, 0);
  EXPECT_EQ(Saved(), text);  // both entities share one text, so it can't be changed
  EXPECT_EQ(wf_.warnings().size(), 1U);
  WritePose(4, 1, 0, 0, 0);
  EXPECT_EQ(Saved(), "define r position( ranger( pose [1 0 0 0] ) )\nr()\nr()\n");
}

TEST_F(SaveTest, LoadedFromAStream) {
  std::istringstream in("a 1");
  wf_.Load(in);
  EXPECT_FALSE(wf_.Save(""));
  EXPECT_TRUE(wf_.Save(Path("new.world")));
  EXPECT_EQ(Read("new.world"), "a 1");
}

TEST_F(SaveTest, FailureIsReportedAndLeavesNoFile) {
  Load("a 1");
  testing::internal::CaptureStderr();
  EXPECT_FALSE(wf_.Save(Path("no/such/folder.world")));
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "unable to save world file " +
                                                        Path("no/such/folder.world") +
                                                        " : No such file or directory\n");
  EXPECT_FALSE(wf_.Save(root_.string()));
  EXPECT_TRUE(wf_.Save(Path("b.world")));
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(root_)) {
    files += entry.is_regular_file() ? 1 : 0;
  }
  EXPECT_EQ(files, 2);  // no temporary file
}

TEST_F(SaveTest, LinksAndModesStay) {
  Load("a 1");
  chmod(Path("w.world").c_str(), 0640);
  std::filesystem::create_symlink(Path("w.world"), Path("link.world"));
  wf_.WriteInt(0, "a", 2);
  EXPECT_TRUE(wf_.Save(Path("link.world")));
  EXPECT_TRUE(std::filesystem::is_symlink(Path("link.world")));
  EXPECT_EQ(Read("w.world"), "a 2");
  struct stat info = {};
  ASSERT_EQ(stat(Path("w.world").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0640U);
}

// ---- unused properties ----

std::string UnusedNames(const Worldfile& wf) {
  std::string names;
  for (const UnusedProperty& unused : wf.Unused()) {
    names += (names.empty() ? "" : " ") + unused.name;
    if (!unused.suggestion.empty()) names += ">" + unused.suggestion;
  }
  return names;
}

void LoadText(Worldfile& wf, const std::string& text) {
  std::istringstream in(text);
  wf.Load(in, "t.world");
}

/// In a folder that everybody can write to, predictable names may already exist.
TEST_F(SaveTest, ToleratesExistingTemporaryNames) {
  Load("speedup 1");
  Write("w.world." + std::to_string(getpid()) + ".tmp", "in the way");
  EXPECT_EQ(Saved(), "speedup 1");
}

TEST_F(SaveTest, APipeIsWrittenToNotReplaced) {
  Load("speedup 1");
  ASSERT_EQ(mkfifo(Path("pipe").c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = Read("pipe"); });
  EXPECT_TRUE(wf_.Save(Path("pipe")));
  const bool stays = std::filesystem::is_fifo(Path("pipe"));
  if (stays) {
    reader.join();
  } else {
    reader.detach();  // it blocks forever
  }
  ASSERT_TRUE(stays);
  EXPECT_EQ(got, "speedup 1");
}

TEST(UnusedTest, ReadingCountsAsUseTestingDoesNot) {
  Worldfile wf;
  LoadText(wf, "a 1 b 2 c [1 2] d 4 e 5");
  wf.ReadInt(0, "a", 0);
  wf.PropertyExists(0, "b");
  double x = 0;
  wf.ReadTuple(0, "c", 0, 1, "f", &x);
  wf.GetProperty(0, "d");
  wf.GetPropertyValue(wf.GetProperty(0, "e"), 0);
  EXPECT_EQ(UnusedNames(wf), "b d");
  wf.GetProperty(0, "d")->used = true;
  EXPECT_EQ(UnusedNames(wf), "b");
}

TEST(UnusedTest, OverriddenAndNeverMadePropertiesAreNotReported) {
  Worldfile wf;
  LoadText(wf, "define m model( a 1 b 1 )\ndefine n model( z 1 )\nm( a 2 a 3 ) m( a 2 )");
  wf.ReadInt(1, "a", 0);
  wf.ReadInt(2, "a", 0);
  EXPECT_EQ(UnusedNames(wf), "b");
}

TEST(UnusedTest, Suggestions) {
  Worldfile wf;
  LoadText(wf,
           "m( rnage 1 obstacle_retrun 1 mac 1 ip 1 yaw 1 shape 1 width 1 points 3 point[3] [1 1] "
           "laser_return 1 nme 1 xyzzy 1 size [1 1 1] size3 1 offset 1 gui_movemask 1 polygons 2 "
           "blobfinder_return 1 power 1 channels 2 ple 2 )");
  for (const char* name :
       {"range",  "obstacle_return", "mass",          "pose",   "samples",  "fov",         "size",
        "name",   "point[0]",        "ranger_return", "origin", "gui_move", "blob_return", "color",
        "colors", "image",           "pan",           "bitmap", "period",   "watts"}) {
    wf.PropertyExists(1, name);
  }
  wf.ReadInt(1, "points", 0);
  EXPECT_EQ(UnusedNames(wf),
            "rnage>range obstacle_retrun>obstacle_return mac ip yaw shape width point[3] "
            "laser_return nme>name xyzzy size size3 offset gui_movemask polygons blobfinder_return "
            "power channels ple");
}

TEST(UnusedTest, WarnsOnceOnStandardError) {
  Worldfile wf;
  LoadText(wf, "m(\n  rnage 1 )\nx \"1y\"");
  wf.ReadFloat(1, "range", 0);
  wf.ReadFloat(0, "x", 0);
  testing::internal::CaptureStderr();
  EXPECT_TRUE(wf.WarnUnused());
  EXPECT_TRUE(wf.WarnUnused());
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "t.world:3:3: warning: property \"x\": found \"1y\", expected a number; read as 1\n"
            "t.world:2:3: warning: property \"rnage\" is never read; did you mean \"range\"?\n");
  wf.ReadInt(1, "rnage", 0);
  EXPECT_FALSE(wf.WarnUnused());
}

TEST(UnusedTest, MacroPropertiesAreReportedOnce) {
  Worldfile wf;
  std::string text = "define s sensor( q 1 )\ndefine m model( s() )\n";
  for (int i = 0; i < 100; ++i) text += "m()\n";
  LoadText(wf, text);
  EXPECT_EQ(UnusedNames(wf), "q");
  EXPECT_EQ(wf.Unused()[0].line, 1);
  EXPECT_EQ(wf.Unused()[0].column, 18);
}

}  // namespace
}  // namespace Stg
