// SPDX-License-Identifier: GPL-2.0-or-later
//
// The notations of numbers in world files. A saved number is read as the same number.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "random/random.hh"
#include "worldfile/numbers.hh"
#include "worldfile_testing.hh"

namespace Stg {
namespace {

using worldfile::FloatText;
using worldfile::IsNumberToken;
using worldfile::ReadFloatText;

double NumberOf(const std::string& text) {
  Worldfile wf;
  LoadText(wf, "model( mass " + text + " )");
  const double value = wf.ReadFloat(1, "mass", -77);
  EXPECT_TRUE(wf.warnings().empty()) << wf.warnings().front();
  return value;
}

TEST(WorldfileNumbers, AllUsualForms) {
  const struct {
    const char* text;
    double value;
  } kForms[] = {{"9e-06", 9e-6},   {"1e3", 1000},        {"1E3", 1000},
                {"-2.5e+2", -250}, {".5", 0.5},          {"5.", 5},
                {"+1", 1},         {".5e1", 5},          {"5.e-1", 0.5},
                {"1e-400", 0},     {"4.9e-324", 5e-324}, {"1.7e308", 1.7e308},
                {"007", 7},        {"+1e+02", 100},      {"1e007", 1e7}};
  for (const auto& form : kForms) {
    EXPECT_EQ(NumberOf(form.text), form.value) << form.text;
    EXPECT_EQ(NumberOf(std::string("[") + form.text + " 2]"), form.value) << form.text;
    EXPECT_TRUE(IsNumberToken(form.text)) << form.text;
  }
}

TEST(WorldfileNumbers, ExponentsInTuplesAndWholeNumbers) {
  Worldfile wf;
  LoadText(wf, "m( p [1e1 2e-1 0 9e+01] n 1e3 s \"1e3\" k [2E2 -1e0 1.5e1] )");
  double p[4] = {};
  EXPECT_EQ(wf.ReadTuple(1, "p", 0, 4, "llfa", &p[0], &p[1], &p[2], &p[3]), 4);
  EXPECT_EQ(p[0], 10);
  EXPECT_EQ(p[1], 0.2);
  EXPECT_DOUBLE_EQ(p[3], M_PI / 2);
  EXPECT_EQ(wf.ReadInt(1, "n", 0), 1000);
  EXPECT_EQ(wf.ReadInt(1, "s", 0), 1000);
  int whole[2] = {};
  unsigned int natural = 0;
  EXPECT_EQ(wf.ReadTuple(1, "k", 0, 2, "ui", &natural, &whole[0]), 2);
  EXPECT_EQ(wf.ReadTuple(1, "k", 2, 1, "i", &whole[1]), 1);
  EXPECT_EQ(natural, 200U);
  EXPECT_EQ(whole[0], -1);
  EXPECT_EQ(whole[1], 15);
  EXPECT_TRUE(wf.warnings().empty());
}

TEST(WorldfileNumbers, FractionsAreNoWholeNumbers) {
  Worldfile wf;
  LoadText(wf, "a 1e-2 b 2.5e0 c 1e10 d \"0x10\"");
  EXPECT_EQ(wf.ReadInt(0, "a", 7), 0);
  EXPECT_EQ(wf.ReadInt(0, "b", 7), 2);
  EXPECT_EQ(wf.ReadInt(0, "c", 7), 2147483647);
  EXPECT_EQ(wf.ReadInt(0, "d", 7), 0);  // as with atoi
  EXPECT_EQ(wf.warnings().size(), 4U);
}

// Numbers in other notations are refused with a message that shows the valid notation.
TEST(WorldfileNumbers, OtherNotationsAreExplained) {
  for (const char* bad : {"1e+", "1e-", "2.5E-x", "1e3x", "1e3.5", "1e3e4", "1e3-2", "1e3+2",
                          "0x10", "0Xff", "-0x1p3"}) {
    for (const char* before : {"model( mass ", "model( pose [1 ", "interval_sim "}) {
      const std::string start = before;
      const std::string place = "t.world:1:" + std::to_string(start.size() + 1) + ": ";
      EXPECT_ERROR(
          start + bad + " 2 ] )", place,
          std::string("found \"") + bad + "\", expected a number such as 16, -0.5 or 9e-06");
    }
  }
}

TEST(WorldfileNumbers, OutOfRangeIsRefused) {
  Worldfile wf;
  LoadText(wf, "m( mass 1e400 n 1e400 )");
  EXPECT_THROW(wf.ReadFloat(1, "mass", 0), LoadError);
  EXPECT_THROW(wf.ReadInt(1, "n", 0), LoadError);
}

// A word may follow a number, as in Stage, without a blank, even if it begins with e or x.
TEST(WorldfileNumbers, NamesMayFollowNumbersWithoutBlank) {
  Worldfile wf;
  LoadText(wf, "mass 1energy 2e\"x\" f 0x 3 h 0xyz 4 i .e5 6");
  EXPECT_EQ(wf.ReadFloat(0, "mass", 0), 1);
  EXPECT_EQ(wf.ReadFloat(0, "energy", 0), 2);
  EXPECT_EQ(wf.ReadString(0, "e", ""), "x");
  EXPECT_EQ(wf.ReadFloat(0, "x", 0), 3);
  EXPECT_EQ(wf.ReadFloat(0, "xyz", 0), 4);
  EXPECT_EQ(wf.ReadFloat(0, "e5", 0), 6);  // a single point can't have an exponent
}

TEST(WorldfileNumbers, IsNumberTokenMatchesTheLexer) {
  for (const char* number : {"1", "-1.5", "1e3", "1e-06", ".5", "1.2.3", "+-1", "."})
    EXPECT_TRUE(IsNumberToken(number)) << number;
  for (const char* word :
       {"", "e3", "1e", "1e+", "1e3x", "1e3.5", "0x10", "inf", "nan", "1 2", ".e5"})
    EXPECT_FALSE(IsNumberToken(word)) << word;
}

bool SameBits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

/// Writes a number into a world file, saves it as text, and reads it again.
double SavedAndRead(double value) {
  const std::string text = FloatText(value);
  EXPECT_TRUE(IsNumberToken(text)) << text;
  Worldfile wf;
  LoadText(wf, "m( a " + text + " )");
  return wf.ReadFloat(1, "a", -77);
}

TEST(WorldfileNumbers, WrittenNumbersAreReadToTheSameBits) {
  for (const double value :
       {0.0, -0.0, 1.0, 0.1, 9e-6, 1e-9, 0.30000000000000004, 1.0 / 3, 5e-324, 1e15, 1e22, -2.5e-7,
        123456.7890123, std::numeric_limits<double>::max(), std::numeric_limits<double>::min()})
    EXPECT_TRUE(SameBits(SavedAndRead(value), value)) << FloatText(value);
  RandomStream random(7);
  for (int i = 0; i < 20000; i++) {
    const double value = std::bit_cast<double>(random.Next());
    if (!std::isfinite(value)) continue;
    ASSERT_TRUE(SameBits(ReadFloatText(FloatText(value)).value, value)) << FloatText(value);
    ASSERT_TRUE(IsNumberToken(FloatText(value)));
  }
}

// Values in metres and radians are saved exactly, values in other units up to a rounding error, and
// unchanged values as they were written in the file.
TEST(WorldfileNumbers, UnitsAddAtMostARounding) {
  RandomStream random(8);
  for (const double unit : {1.0, 0.01, 0.001, M_PI / 180}) {
    for (int i = 0; i < 5000; i++) {
      const double value = random.Uniform() * 20 - 10;
      const double read = ReadFloatText(worldfile::TextInUnit(value, unit)).value * unit;
      ASSERT_TRUE(unit != 1.0 || read == value) << value;
      ASSERT_LE(std::fabs(read - value), 2.3e-16 * std::fabs(value)) << unit;
      const double written = std::round(value * 1000) / 1000;
      const std::string text = worldfile::TextInUnit(written * unit, unit);
      ASSERT_EQ(ReadFloatText(text).value, written) << text;
    }
  }
}

}  // namespace
}  // namespace Stg
