// SPDX-License-Identifier: GPL-2.0-or-later
//
// Includes of world files, and reading of values.
#include <gtest/gtest.h>
#include <unistd.h>

#include <clocale>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "geometry/load_error.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile.hh"
#include "worldfile_testing.hh"

namespace Stg {
namespace {

// A temporary folder for files.
class WorldFolder : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    root_ = std::filesystem::temp_directory_path() /
            (std::string("stage_worldfile_") + info->name() + std::to_string(getpid()));
    std::filesystem::create_directories(root_);
    unsetenv("STAGEPATH");
    SetLogSink([this](LogLevel level, const std::string& line) {
      if (level == LogLevel::kProgress) progress_ += line;
    });
  }
  void TearDown() override {
    SetLogSink({});
    unsetenv("STAGEPATH");
    std::filesystem::remove_all(root_);
  }
  std::string Path(const std::string& name) { return (root_ / name).string(); }
  std::string Write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = root_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
    return path.string();
  }
  std::string FileError(const std::string& path) {
    try {
      wf_.Load(path);
    } catch (const LoadError& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path root_;
  std::string progress_;
  Worldfile wf_;
};

// ---- 4 include ----

TEST_F(WorldFolder, IncludesResolveBesideTheWorld) {
  Write("deep.inc", "deep 1\n");
  Write("sub/deep.inc", "deep 2\n");
  Write("sub/s.inc", "include \"deep.inc\"\n");
  wf_.Load(Write("w.world", "include \"sub/s.inc\"\n"));
  EXPECT_EQ(wf_.ReadInt(0, "deep", 0), 1);
  EXPECT_EQ(progress_, "[Include sub/s.inc][Include deep.inc]");
}

TEST_F(WorldFolder, IncludeAsLastLineWithoutLineEnd) {
  Write("a.inc", "a 1");
  wf_.Load(Write("w.world", "b 2\ninclude \"a.inc\""));
  EXPECT_EQ(wf_.ReadInt(0, "a", 0), 1);
}

TEST_F(WorldFolder, RestOfTheIncludeLineIsNotRead) {
  Write("a.inc", "a 1\n");
  wf_.Load(Write("w.world", "include \"a.inc\" # fine\ninclude \"a.inc\" include \"b.inc\"\nc 3"));
  EXPECT_EQ(wf_.ReadInt(0, "c", 0), 3);
  ASSERT_EQ(wf_.warnings().size(), 1U);
  EXPECT_EQ(wf_.warnings()[0].rfind(Path("w.world") + ":2:17: warning: ", 0), 0U);
}

TEST_F(WorldFolder, IncludeInABody) {
  Write("body.inc", "size 3 color \"red\"");
  wf_.Load(Write("w.world", "model(\n include \"body.inc\"\n name \"q\" )"));
  EXPECT_EQ(wf_.ReadInt(1, "size", 0), 3);
  EXPECT_EQ(wf_.ReadString(1, "name", ""), "q");
  EXPECT_FALSE(wf_.PropertyExists(1, "include"));
  Write("def.inc", "define a b ( )");
  EXPECT_NE(FileError(Write("w.world", "model(\n include \"def.inc\"\n)")), "");
}

TEST_F(WorldFolder, ErrorsNameTheTrueFile) {
  const std::string inc = Write("a.inc", "\n\nb c\n");
  EXPECT_EQ(FileError(Write("w.world", "include \"a.inc\"\n")).rfind(inc + ":3:3: ", 0), 0U);
  Write("a.inc", "\n\nb 1\n");
  const std::string world = Write("w.world", "include \"a.inc\"\nd e\n");
  EXPECT_EQ(FileError(world).rfind(world + ":2:3: ", 0), 0U);
}

TEST_F(WorldFolder, IncludeStatementMistakes) {
  for (const char* line : {"include foo.inc", "include\"foo.inc\"", "include\n\"a\"", "include (",
                           "include \"a\nb\""}) {
    EXPECT_ERROR(std::string(line) + "\nx 1\n", "t.world:1:", "syntax error in include statement");
  }
  for (const char* line : {"include", "include ", "include \"a"}) {
    EXPECT_ERROR(line, "t.world:1:1: ", "incomplete include statement");
  }
  Write("a.inc", "a 1");
  EXPECT_NE(FileError(Write("w.world", "name include \"a.inc\"\n")), "");
  EXPECT_NE(FileError(Write("w.world", "t [1 include \"a.inc\"\n]")), "");
}

TEST_F(WorldFolder, MissingInclude) {
  const std::string world = Write("w.world", "\n include \"no.inc\"\n");
  EXPECT_EQ(FileError(world), world + ":2:10: unable to open include file " + Path("no.inc") +
                                  " : No such file or directory");
  EXPECT_NE(FileError(Write("w.world", "include \"~/no.inc\"\n")).find(" ~/no.inc : "),
            std::string::npos);
  EXPECT_NE(FileError(Write("w.world", "include \"\"\n")), "");
  std::filesystem::create_directory(root_ / "folder");
  EXPECT_NE(FileError(Write("w.world", "include \"folder\"\n")).find("Is a directory"),
            std::string::npos);
  EXPECT_NE(FileError(Write("w.world", "include \"/dev/zero\"\n")).find("special file"),
            std::string::npos);
}

TEST_F(WorldFolder, IncludeCycles) {
  const std::string a = Write("a.inc", "include \"b.inc\"\n");
  const std::string b = Write("b.inc", "x 1\ninclude \"sub/../a.inc\"\n");
  std::filesystem::create_directory(root_ / "sub");
  const std::string error = FileError(Write("w.world", "include \"a.inc\"\n"));
  EXPECT_EQ(error.rfind(b + ":2:9: found an include cycle (" + a + " -> " + b + " -> " + a, 0), 0U)
      << error;
  const std::string self = Write("self.world", "include \"self.world\"\n");
  EXPECT_NE(FileError(self).find(self + " -> " + self), std::string::npos);
}

TEST_F(WorldFolder, SameFileTwiceIsFine) {
  Write("a.inc", "define m model( )\n");
  wf_.Load(Write("w.world", "include \"a.inc\"\ninclude \"a.inc\"\nm()"));
  EXPECT_EQ(Tree(wf_), "model:0");
  EXPECT_TRUE(wf_.warnings().empty());
}

TEST_F(WorldFolder, IncludeBombsEnd) {
  for (int i = 0; i < 150; ++i) {
    const std::string next = "include \"i" + std::to_string(i + 1) + ".inc\"\n";
    Write("i" + std::to_string(i) + ".inc", next);
    Write("j" + std::to_string(i) + ".inc", i == 40 ? ""
                                                    : "include \"j" + std::to_string(i + 1) +
                                                          ".inc\"\ninclude \"j" +
                                                          std::to_string(i + 1) + ".inc\"\n");
  }
  EXPECT_NE(FileError(Path("i0.inc")).find("more than 100 deep"), std::string::npos);
  EXPECT_NE(FileError(Path("j0.inc")).find("more than 1000 include lines"), std::string::npos);
}

TEST_F(WorldFolder, StagePathHoldsTheLastComponent) {
  Write("p1/foo.inc", "foo 1\n");
  Write("p2/foo.inc", "foo 2\n");
  Write("p2/bar.inc", "bar 2\n");
  Write("beside.inc", "beside 3\n");
  const std::string path = Path("none") + "::" + Path("p1") + ":" + Path("p2");
  setenv("STAGEPATH", path.c_str(), 1);
  const std::string world =
      Write("w.world", "include \"x/y/foo.inc\"\ninclude \"bar.inc\"\ninclude \"beside.inc\"\n");
  wf_.Load(world);
  EXPECT_EQ(wf_.ReadInt(0, "foo", 0), 1);
  EXPECT_EQ(wf_.ReadInt(0, "bar", 0), 2);
  EXPECT_EQ(wf_.ReadInt(0, "beside", 0), 3);
  EXPECT_EQ(wf_.filename, world);
  EXPECT_STREQ(getenv("STAGEPATH"), path.c_str());
}

TEST_F(WorldFolder, WorldFromStagePathIsItsOwnBase) {
  Write("p/w.world", "include \"a.inc\"\n");
  Write("p/a.inc", "a 1\n");
  setenv("STAGEPATH", Path("p").c_str(), 1);
  wf_.Load("no/such/w.world");
  EXPECT_EQ(wf_.filename, Path("p/w.world"));
  EXPECT_EQ(wf_.ReadInt(0, "a", 0), 1);
}

TEST_F(WorldFolder, InvalidFiles) {
  EXPECT_EQ(FileError(Path("no.world")),
            Path("no.world") + ": unable to open world file: No such file or directory");
  EXPECT_NE(FileError(root_.string()).find("Is a directory"), std::string::npos);
  EXPECT_NE(FileError(""), "");
  EXPECT_NE(FileError("/dev/zero").find("more than 20 MiB"), std::string::npos);
}

TEST_F(WorldFolder, StreamsResolveByTheGivenName) {
  Write("a.inc", "a 1\n");
  std::istringstream in("include \"a.inc\"\nf \"x.png\" g \"/x.png\"");
  wf_.Load(in, Path("w.world"));
  EXPECT_EQ(wf_.ReadInt(0, "a", 0), 1);
  EXPECT_EQ(std::string(wf_.ReadFilename(0, "f", "")), Path("x.png"));
  EXPECT_EQ(std::string(wf_.ReadFilename(0, "g", "")), "/x.png");
  const char* fallback = "def";
  EXPECT_EQ(wf_.ReadFilename(0, "h", fallback), fallback);
  std::istringstream unnamed("f \"x.png\"");
  wf_.Load(unnamed);
  EXPECT_EQ(std::string(wf_.ReadFilename(0, "f", "")),
            std::filesystem::current_path().string() + "/x.png");
}

TEST_F(WorldFolder, AFailedLoadLeavesAnEmptyWorld) {
  wf_.Load(Write("w.world", "unit_length \"cm\" m()"));
  EXPECT_NE(FileError(Write("bad.world", "m( ")), "");
  EXPECT_EQ(wf_.GetEntityCount(), 1);
  EXPECT_EQ(wf_.unit_length, 1.0);
  EXPECT_FALSE(wf_.PropertyExists(0, "unit_length"));
}

// ---- 5 values ----

TEST(WorldfileValues, Integers) {
  Worldfile wf;
  LoadText(wf,
           "a 33.7 b \"12x\" c \"yes\" d --5 e \" -7 \" f +3 g 99999999999 h -99999999999 i 4.0 "
           "j \"0x10\" k [7 8] l [] m .5");
  const std::vector<int> expected{33, 12, 0, 0, -7, 3, 2147483647, -2147483647 - 1, 4, 0, 7, 42, 0};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::string name(1, static_cast<char>('a' + i));
    EXPECT_EQ(wf.ReadInt(0, name.c_str(), 42), expected[i]) << name;
  }
  EXPECT_EQ(wf.ReadInt(0, "z", 42), 42);
  EXPECT_EQ(wf.warnings().size(), 9U);  // not e, f, i, k
}

TEST(WorldfileValues, Floats) {
  Worldfile wf;
  LoadText(wf,
           "a \"abc\" b --5 c 1.2.3 d .5 e +2 f \"1e3\" g \"0x10\" h \" 5 \" i [7 8] j [] k \"\" "
           "l 5- m \"1,5\"");
  const std::vector<double> expected{0, 0, 1.2, 0.5, 2, 1000, 16, 5, 7, 42, 0, 5, 1};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::string name(1, static_cast<char>('a' + i));
    EXPECT_EQ(wf.ReadFloat(0, name.c_str(), 42), expected[i]) << name;
  }
  EXPECT_EQ(wf.ReadFloat(0, "z", 42), 42);
  EXPECT_EQ(wf.warnings().size(), 7U);  // a b c j k l m
  EXPECT_EQ(wf.warnings()[0],
            "t.world:1:3: warning: property \"a\": found \"abc\", expected a number; read as 0");
}

/// Floats are read as by std::from_chars, which some standard libraries lack for doubles.
TEST(WorldfileValues, WholeFloats) {
  const struct {
    const char* text;
    double value;
  } good[] = {{"0", 0},
              {"-0.5", -0.5},
              {"5.", 5},
              {".25", 0.25},
              {"1e3", 1000},
              {"1E+3", 1000},
              {"-2.5e-3", -2.5e-3},
              {"1e308", 1e308},
              {"0.1", 0.1},
              {"5e-324", 5e-324},
              {"123456789012345678", 123456789012345678.0}};
  for (const auto& c : good) EXPECT_EQ(worldfile::ReadWholeFloat(c.text), c.value) << c.text;
  for (const char* bad :
       {"",      " ",    "1 ",    " 1",  "+1",  "--1",      "-",     ".",      "e3",  "1e", "1e+",
        "1.2.3", "0x10", "0x1p3", "inf", "nan", "infinity", "1e309", "-1e309", "1,5", "1m"})
    EXPECT_EQ(worldfile::ReadWholeFloat(bad), std::nullopt) << bad;
  EXPECT_EQ(worldfile::ReadWholeFloat(std::string_view("1\0", 2)), std::nullopt);
  EXPECT_EQ(worldfile::ReadWholeFloat(std::string_view("12345", 2)), 12);
}

TEST(WorldfileValues, AnyLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  bool comma = false;
  for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"}) {
    comma = comma || std::setlocale(LC_ALL, name) != nullptr;
  }
  Worldfile wf;
  LoadText(wf, "a 1.5");
  EXPECT_EQ(wf.ReadFloat(0, "a", 0), 1.5);
  EXPECT_EQ(worldfile::ReadWholeFloat("1.5"), 1.5);
  std::setlocale(LC_ALL, before.c_str());
  if (!comma) GTEST_SKIP() << "no locale with a decimal comma is installed";
}

TEST(WorldfileValues, NumbersMustBeFinite) {
  for (const char* value : {"\"nan\"", "\"inf\"", "\"-infinity\"", "\"1e999\"", "\"NAN(1)\""}) {
    Worldfile wf;
    LoadText(wf, std::string("m(\n range ") + value + " t [1 " + value + "] )");
    EXPECT_THROW(wf.ReadFloat(1, "range", 0), LoadError) << value;
    EXPECT_THROW(wf.ReadLength(1, "range", 0), LoadError) << value;
    EXPECT_THROW(wf.ReadAngle(1, "range", 0), LoadError) << value;
    EXPECT_EQ(wf.ReadString(1, "range", ""), std::string(value).substr(1, strlen(value) - 2));
    double x = 5, y = 6;
    EXPECT_THROW(wf.ReadTuple(1, "t", 0, 2, "ff", &x, &y), LoadError) << value;
    EXPECT_EQ(x, 5);
    try {
      wf.ReadFloat(1, "range", 0);
    } catch (const LoadError& error) {
      EXPECT_EQ(std::string(error.what()).rfind("t.world:2:8: property \"range\": found ", 0), 0U);
    }
  }
}

TEST(WorldfileValues, Units) {
  const double degree = 3.14159265358979323846 / 180;
  Worldfile wf;
  LoadText(wf, "l 200 a 90 t [200 90 5] unit_length \"cm\"");
  EXPECT_DOUBLE_EQ(wf.ReadLength(0, "l", 0), 2);
  EXPECT_DOUBLE_EQ(wf.ReadAngle(0, "a", 0), 90 * degree);
  EXPECT_DOUBLE_EQ(wf.ReadFloat(0, "l", 0), 200);
  EXPECT_EQ(wf.ReadLength(0, "x", 7), 7);
  EXPECT_EQ(wf.ReadAngle(0, "x", 7), 7);
  double l = 0, a = 0, f = 0;
  EXPECT_EQ(wf.ReadTuple(0, "t", 0, 3, "laf", &l, &a, &f), 3);
  EXPECT_DOUBLE_EQ(l, 2);
  EXPECT_DOUBLE_EQ(a, 90 * degree);
  EXPECT_DOUBLE_EQ(f, 5);
  LoadText(wf, "unit_length \"mm\" unit_angle \"radians\" l 200 a 2");
  EXPECT_DOUBLE_EQ(wf.ReadLength(0, "l", 0), 0.2);
  EXPECT_EQ(wf.ReadAngle(0, "a", 0), 2);
  LoadText(wf, "unit_length \"inch\" unit_angle \"grad\" l 2");
  EXPECT_EQ(wf.ReadLength(0, "l", 0), 2);
  EXPECT_EQ(wf.warnings().size(), 2U);
}

TEST(WorldfileValues, Tuples) {
  Worldfile wf;
  LoadText(wf, "m( t [1 -2 \"three\" 4.5 9] p [1 2 3] s 1 e [ ] )");
  int i = 0;
  unsigned int u = 7;
  char* s = nullptr;
  double f = 0;
  EXPECT_EQ(wf.ReadTuple(1, "t", 0, 4, "iusf", &i, &u, &s, &f), 4);
  EXPECT_EQ(i, 1);
  EXPECT_EQ(u, 0U);
  EXPECT_STREQ(s, "three");
  EXPECT_EQ(f, 4.5);
  std::free(s);
  EXPECT_EQ(wf.ReadTuple(1, "t", 3, 1, "f", &f), 1);
  EXPECT_EQ(f, 4.5);
  EXPECT_EQ(wf.ReadTuple(1, "none", 0, 1, "f", &f), 0);
  EXPECT_EQ(f, 4.5);
  for (const char* name : {"p", "s", "e"}) {
    EXPECT_THROW(wf.ReadTuple(1, name, 0, 4, "llla", &f, &f, &f, &f), LoadError) << name;
  }
  try {
    wf.ReadTuple(1, "p", 0, 4, "llla", &f, &f, &f, &f);
  } catch (const LoadError& error) {
    EXPECT_STREQ(error.what(),
                 "t.world:1:30: property \"p\": found a tuple of length 3, expected at least 4 "
                 "values");
    EXPECT_EQ(error.exit_status(), 1);
  }
  EXPECT_EQ(wf.TupleLength(1, "t"), 5U);
  EXPECT_EQ(wf.TupleLength(1, "e"), 0U);
  EXPECT_EQ(wf.TupleLength(1, "s"), 1U);
}

TEST(WorldfileValues, Handles) {
  Worldfile wf;
  LoadText(wf, "m(\n t [1 \"b\"] )");
  CProperty* property = wf.GetProperty(1, "t");
  ASSERT_NE(property, nullptr);
  EXPECT_EQ(property->entity, 1);
  EXPECT_EQ(property->name, "t");
  EXPECT_EQ(property->values.size(), 2U);
  EXPECT_EQ(property->file, "t.world");
  EXPECT_EQ(property->line, 2);
  EXPECT_EQ(property->column, 2);
  EXPECT_FALSE(property->used);
  EXPECT_STREQ(wf.GetPropertyValue(property, 1), "b");
  EXPECT_EQ(wf.GetPropertyValue(property, 2), nullptr);
  EXPECT_EQ(wf.GetPropertyValue(nullptr, 0), nullptr);
  EXPECT_TRUE(property->used);
  EXPECT_EQ(wf.GetProperty(1, "x"), nullptr);
  EXPECT_EQ(wf.GetProperty(1, "t"), property);
}

TEST(WorldfileValues, Places) {
  Worldfile wf;
  LoadText(wf, "\n m( t [1 2]\n s \"x\" )");
  EXPECT_EQ(wf.Where(1, "t"), "t.world:2:8");
  EXPECT_EQ(wf.Where(1, "s"), "t.world:3:4");
  EXPECT_EQ(wf.Where(1, "none"), "t.world:2:2");
  EXPECT_EQ(wf.Where(0, "none"), "t.world:1:1");
  EXPECT_EQ(wf.Where(77, "none"), "t.world:1:1");
  try {
    wf.Fail(1, "s", "found it, expected another");
    FAIL();
  } catch (const LoadError& error) {
    EXPECT_STREQ(error.what(), "t.world:3:4: found it, expected another");
  }
}

TEST(WorldfileValues, InvalidEntities) {
  Worldfile wf;
  LoadText(wf, "a 1");
  EXPECT_EQ(wf.ReadInt(-1, "a", 5), 5);
  EXPECT_EQ(wf.ReadInt(9, "a", 5), 5);
  wf.WriteInt(9, "a", 5);
  EXPECT_EQ(wf.GetProperty(9, "a"), nullptr);
}

}  // namespace
}  // namespace Stg
