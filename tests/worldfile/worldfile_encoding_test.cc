// SPDX-License-Identifier: GPL-2.0-or-later
//
// World files from various editors and systems: byte order marks, line ends, encodings, and files
// that can't be included.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "worldfile_testing.hh"

namespace Stg {
namespace {

const std::string kMark = "\xef\xbb\xbf";

TEST(WorldfileEncoding, SkipsByteOrderMark) {
  EXPECT_EQ(TreeOf(kMark + "model( )"), "model:0");
  EXPECT_EQ(TreeOf(kMark + "\r\nmodel( )"), "model:0");
  EXPECT_EQ(TreeOf(kMark), "");
}

TEST(WorldfileEncoding, AByteOrderMarkShiftsNoColumn) {
  EXPECT_ERROR(kMark + "a ,", "t.world:1:3: ", "','");
  EXPECT_ERROR(kMark + ",", "t.world:1:1: ", "','");
  EXPECT_ERROR(kMark + "a 1\n ,", "t.world:2:2: ", "','");
  EXPECT_ERROR(kMark + std::string(10000, ' ') + ",", "t.world:1:10001: ", "','");
}

TEST(WorldfileEncoding, AMarkElsewhereIsAnError) {
  EXPECT_ERROR(" " + kMark + "a 1", "t.world:1:2: ", "byte 0xef");
  EXPECT_ERROR(kMark + kMark + "a 1", "t.world:1:1: ", "byte 0xef");
}

std::string Widened(const std::string& text, bool big_endian, std::size_t width = 2) {
  std::string wide;
  for (const char c : text) {
    std::string unit(width, '\0');
    unit[big_endian ? width - 1 : 0] = c;
    wide += unit;
  }
  return wide;
}

TEST(WorldfileEncoding, Utf16IsNamed) {
  const std::string little = Widened("model( )\n", false), big = Widened("model( )\n", true);
  for (const std::string& text : {"\xff\xfe" + little, "\xfe\xff" + big, little, big,
                                  std::string("\xff\xfe\0\0", 4) + Widened("model( )", false, 4)})
    EXPECT_ERROR(text, "t.world:1:1: ", "found UTF-16 or UTF-32, expected UTF-8");
}

TEST(WorldfileEncoding, ColumnsCountBytesATabIsOne) {
  EXPECT_ERROR("\ta \"\xc3\xa9\" ,", "t.world:1:9: ", "','");
  EXPECT_ERROR("# \xc3\xa9\n\t\t,", "t.world:2:3: ", "','");
}

TEST(WorldfileEncoding, NamesNeedNotBeUtf8) {
  Worldfile wf;
  LoadText(wf, "model( name \"M\xfchle\" )");
  EXPECT_EQ(wf.ReadString(1, "name", ""), "M\xfchle");
}

// ---- files ----

class WorldfileIncludes : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "stage-encoding-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(root_ / name, std::ios::binary) << text;
    return (root_ / name).string();
  }
  std::string ErrorOfFile(const std::string& path) {
    try {
      wf_.Load(path);
    } catch (const LoadError& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path root_;
  Worldfile wf_;
};

TEST_F(WorldfileIncludes, LineEndsAndMarksOfAllSystems) {
  for (const char* end : {"\n", "\r", "\r\n", "\n\r"})
    for (const std::string& mark : {std::string(), kMark}) {
      Write("a.inc", mark + "define m model(" + end + "mass 3" + end + ")" + end);
      const std::string path =
          Write("w.world", mark + "include \"a.inc\" # x" + end + "m()" + end + "m( , )");
      const std::string error = ErrorOfFile(path);
      EXPECT_EQ(error.rfind(path + ":3:4: ", 0), 0u) << error;
      Write("w.world", mark + "include \"a.inc\"" + end + "m()");
      EXPECT_EQ(ErrorOfFile(path), "");
      EXPECT_EQ(wf_.ReadFloat(1, "mass", 0), 3);
    }
}

TEST_F(WorldfileIncludes, ASavedFileKeepsItsMark) {
  const std::string path = Write("w.world", kMark + "model( mass 1 )");
  wf_.Load(path);
  wf_.WriteFloat(1, "mass", 2);
  ASSERT_TRUE(wf_.Save(""));
  std::ifstream in(path, std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), kMark + "model( mass 2 )");
}

// Each kind of invalid file is reported immediately, with the place of the include.
TEST_F(WorldfileIncludes, InvalidIncludesAreReportedWithTheirPlace) {
  ASSERT_EQ(mkfifo((root_ / "fifo").c_str(), 0600), 0);
  std::filesystem::create_directory(root_ / "folder");
  std::filesystem::create_symlink("loop", root_ / "loop");
  Write("secret", "a 1");
  std::filesystem::permissions(root_ / "secret", std::filesystem::perms::none);
  Write("huge", std::string((20U << 20) + 1, '#'));
  Write("wide", Widened("a 1\n", false));
  const struct {
    std::string name;
    const char* part;
  } kFiles[] = {{"/proc/self/mem", "unable to read the file"},
                {"fifo", "special file"},
                {"/dev/zero", "special file"},
                {"/dev/null", "special file"},
                {"folder", "Is a directory"},
                {"/", "Is a directory"},
                {"loop", "symbolic links"},
                {"none", "No such file"},
                {"huge", "more than 20 MiB"},
                {std::string(300, 'x'), "name too long"},
                {"", "Is a directory"}};
  for (const auto& file : kFiles) {
    const std::string path = Write("w.world", "a 1\n  include \"" + file.name + "\"\n");
    const std::string error = ErrorOfFile(path);
    EXPECT_EQ(error.rfind(path + ":2:11: ", 0), 0u) << file.name << ": " << error;
    EXPECT_NE(error.find(file.part), std::string::npos) << error;
  }
  if (geteuid() != 0) {
    const std::string path = Write("w.world", "include \"secret\"");
    EXPECT_EQ(ErrorOfFile(path).rfind(path + ":1:9: ", 0), 0u);
  }
  EXPECT_EQ(ErrorOfFile(Write("w.world", "include \"wide\""))
                .rfind((root_ / "wide").string() + ":1:1: found UTF-16", 0),
            0u);
}

}  // namespace
}  // namespace Stg
