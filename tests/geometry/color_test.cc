// SPDX-License-Identifier: GPL-2.0-or-later
#include "pictures/color.hh"

#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <string>

#include "geometry/load_error.hh"
#include "pictures/x11_colors.hh"
#include "random/random.hh"
#include "worldfile/worldfile.hh"

namespace Stg {
namespace {

bool Same(const Color& a, double r, double g, double b, double alpha) {
  return a.r == r && a.g == g && a.b == b && a.a == alpha;
}

Color LoadFrom(const std::string& text, Color start, Worldfile* wf) {
  std::istringstream in(text);
  wf->Load(in);
  return start.Load(wf, 1);
}

Color LoadFrom(const std::string& text) {
  Worldfile wf;
  return LoadFrom(text, Color(0.1, 0.2, 0.3, 0.4), &wf);
}

TEST(ColorTest, DefaultIsOpaqueRed) { EXPECT_TRUE(Same(Color(), 1, 0, 0, 1)); }

TEST(ColorTest, PartsAreStoredAsGiven) {
  EXPECT_TRUE(Same(Color(255, -1, 0.5), 255, -1, 0.5, 1));
  EXPECT_TRUE(Same(Color(0, 0, 0, 0.25), 0, 0, 0, 0.25));
}

TEST(ColorTest, Constants) {
  EXPECT_TRUE(Same(Color::blue, 0, 0, 1, 1));
  EXPECT_TRUE(Same(Color::red, 1, 0, 0, 1));
  EXPECT_TRUE(Same(Color::green, 0, 1, 0, 1));
  EXPECT_TRUE(Same(Color::yellow, 1, 1, 0, 1));
  EXPECT_TRUE(Same(Color::magenta, 1, 0, 1, 1));
  EXPECT_TRUE(Same(Color::cyan, 0, 1, 1, 1));
}

TEST(ColorTest, NamesInBothSpellings) {
  EXPECT_TRUE(Same(Color("LightBlue"), 173 / 255.0, 216 / 255.0, 230 / 255.0, 1));
  EXPECT_TRUE(Same(Color("light blue"), 173 / 255.0, 216 / 255.0, 230 / 255.0, 1));
  EXPECT_TRUE(Same(Color("gray50"), 127 / 255.0, 127 / 255.0, 127 / 255.0, 1));
  EXPECT_TRUE(Same(Color("blue"), 0, 0, 1, 1));
}

TEST(ColorTest, UnknownNamesAreRed) {
  for (const char* name : {"", "liteblue", "#ff000", "#", "#ggg", "#-12", "nosuch", "zzz", "A"}) {
    EXPECT_TRUE(Same(Color(std::string(name)), 1, 0, 0, 1)) << name;
    Color color(0.5, 0.5, 0.5);
    EXPECT_FALSE(Color::Lookup(name, &color)) << name;
    EXPECT_TRUE(Same(color, 0.5, 0.5, 0.5, 1)) << name;
  }
}

TEST(ColorTest, CaseAndBlanksOfNamesDoNotMatter) {
  for (const char* name : {"lightblue", "LightBlue", "light blue", "LIGHTBLUE", "Light  Blue "})
    EXPECT_TRUE(Same(Color(std::string(name)), 173 / 255.0, 216 / 255.0, 230 / 255.0, 1)) << name;
  EXPECT_TRUE(Same(Color("Gray30"), 77 / 255.0, 77 / 255.0, 77 / 255.0, 1));
}

TEST(ColorTest, DigitsAreReadAsInX11) {
  EXPECT_TRUE(Same(Color("#ff0000"), 1, 0, 0, 1));
  EXPECT_TRUE(Same(Color("#0F0"), 0, 1, 0, 1));
  EXPECT_TRUE(Same(Color("#336699"), 0x33 / 255.0, 0x66 / 255.0, 0x99 / 255.0, 1));
  EXPECT_TRUE(Same(Color("#000fff000"), 0, 1, 0, 1));
  EXPECT_TRUE(Same(Color("#00000000ffff"), 0, 0, 1, 1));
}

TEST(ColorTest, EveryNameOfTheTableIsFound) {
  const auto table = geometry::X11Colors();
  EXPECT_GE(table.size(), 752U);
  std::set<std::string> names;
  for (const auto& entry : table) {
    Color color;
    ASSERT_TRUE(Color::Lookup(std::string(entry.name), &color)) << entry.name;
    EXPECT_TRUE(Same(color, entry.red / 255.0, entry.green / 255.0, entry.blue / 255.0, 1));
    EXPECT_TRUE(names.insert(std::string(entry.name)).second) << entry.name;
  }
}

TEST(ColorTest, EqualWithinATenThousandth) {
  const Color base(0.5, 0.5, 0.5, 0.5);
  EXPECT_TRUE(base == Color(0.50009, 0.5, 0.5, 0.5));
  EXPECT_FALSE(base != Color(0.5, 0.5, 0.5, 0.50009));
  EXPECT_TRUE(base != Color(0.5002, 0.5, 0.5, 0.5));
  EXPECT_TRUE(base != Color(0.5, 0.5002, 0.5, 0.5));
  EXPECT_TRUE(base != Color(0.5, 0.5, 0.4998, 0.5));
  EXPECT_FALSE(base == Color(0.5, 0.5, 0.5, 0.4998));
}

TEST(ColorTest, Prints) {
  testing::internal::CaptureStdout();
  Color(0.123, 1, 0, 0.5).Print("hue");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "hue [0.12 1.00 0.00 0.50]\n");
}

TEST(ColorTest, RandomColoursComeFromTheCurrentStream) {
  RandomStream::Current().Seed(7);
  const Color first = Color::RandomColor();
  const Color second = Color::RandomColor();
  RandomStream::Current().Seed(7);
  const Color again = Color::RandomColor();
  EXPECT_TRUE(Same(again, first.r, first.g, first.b, 1));
  EXPECT_TRUE(first != second);
}

TEST(ColorTest, LoadsFromAWorldFile) {
  EXPECT_TRUE(Same(LoadFrom("model( color \"blue\" )"), 0, 0, 1, 1));
  EXPECT_TRUE(Same(LoadFrom("model( color \"\" )"), 1, 0, 0, 1));
  EXPECT_TRUE(Same(LoadFrom("model( color_rgba [255 0.5 0 0.25] )"), 255, 0.5, 0, 0.25));
  EXPECT_TRUE(Same(LoadFrom("model( )"), 0.1, 0.2, 0.3, 0.4));
}

TEST(ColorTest, ColorWinsOverColorRgba) {
  EXPECT_TRUE(Same(LoadFrom("model( color_rgba [0 0 0 0] color \"green\" )"), 0, 1, 0, 1));
  EXPECT_TRUE(Same(LoadFrom("model( color \"\" color_rgba [0 0 0 0] )"), 1, 0, 0, 1));
  EXPECT_TRUE(
      Same(LoadFrom("define m model( color \"blue\" ) m( color_rgba [0 0 0 0] )"), 0, 0, 1, 1));
}

TEST(ColorTest, LoadRandom) {
  RandomStream::Current().Seed(3);
  const Color expected = Color::RandomColor();
  RandomStream::Current().Seed(3);
  const Color color = LoadFrom("model( color \"random\" )");
  EXPECT_TRUE(Same(color, expected.r, expected.g, expected.b, 1));
}

TEST(ColorTest, UnknownNameInAWorldFileIsRedWithAWarning) {
  Worldfile wf;
  EXPECT_TRUE(Same(LoadFrom("model(\n color \"LightBlu\" )", Color(0, 0, 0), &wf), 1, 0, 0, 1));
  ASSERT_EQ(wf.warnings().size(), 1U);
  EXPECT_EQ(
      wf.warnings()[0],
      "<stream>:2:8: warning: found \"LightBlu\", expected an X11 color name, such as \"red\" or "
      "\"#ff0000\"; using red; did you mean \"light blue\"?");
}

TEST(ColorTest, ShortColorRgbaIsAnError) {
  EXPECT_THROW(LoadFrom("model( color_rgba [1 0 0] )"), LoadError);
}

// xoshiro256** seeded by splitmix64(1), computed with an independent program.
TEST(RandomTest, KnownSequence) {
  RandomStream random(1);
  EXPECT_EQ(random.Next(), 0xb3f2af6d0fc710c5U);
  EXPECT_EQ(random.Next(), 0x853b559647364ceaU);
  EXPECT_EQ(random.Next(), 0x92f89756082a4514U);
}

TEST(RandomTest, UniformStaysInItsInterval) {
  RandomStream random(5);
  double sum = 0;
  for (int i = 0; i < 100000; ++i) {
    const double value = random.Uniform();
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    sum += value;
    const double other = random.Uniform(-2, 3);
    ASSERT_GE(other, -2.0);
    ASSERT_LT(other, 3.0);
  }
  EXPECT_NEAR(sum / 100000, 0.5, 0.01);
  EXPECT_EQ(random.Uniform(4, 4), 4.0);
}

TEST(RandomTest, SeedsDiffer) {
  RandomStream a(1), b(2), c(1);
  EXPECT_NE(a.Next(), b.Next());
  c.Seed(1);
  a.Seed(1);
  EXPECT_EQ(a.Next(), c.Next());
}

}  // namespace
}  // namespace Stg
