// SPDX-License-Identifier: GPL-2.0-or-later
//
// The world file's language: words, grammar, macros, limits. Includes and
// values are in worldfile_values_test.cc, saving and the report of unused properties in
// worldfile_save_test.cc.
#include "worldfile/worldfile.hh"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "random/random.hh"
#include "worldfile_testing.hh"

namespace Stg {
namespace {

// ---- 1 words ----

TEST(WorldfileWords, WordsSwallowBracketsAndDots) {
  Worldfile wf;
  LoadText(wf, "point[0] 1 block[0].points 2 a-b_c.d 3");
  EXPECT_EQ(wf.ReadInt(0, "point[0]", 0), 1);
  EXPECT_EQ(wf.ReadInt(0, "block[0].points", 0), 2);
  EXPECT_EQ(wf.ReadInt(0, "a-b_c.d", 0), 3);
  EXPECT_FALSE(wf.PropertyExists(0, "point[00]"));
}

TEST(WorldfileWords, NoBlankNeededWhereCharactersDiffer) {
  Worldfile wf;
  LoadText(wf, "mass\"3\"size 3name\"foo\"");
  EXPECT_EQ(wf.ReadFloat(0, "mass", 0), 3);
  EXPECT_EQ(wf.ReadFloat(0, "size", 0), 3);
  EXPECT_EQ(wf.ReadString(0, "name", ""), "foo");
}

TEST(WorldfileWords, BlankBeforeBracketIsNeeded) {
  EXPECT_ERROR("model( size[1 2 3] )", "t.world:1:17: ", "a space is needed before the '['");
}

TEST(WorldfileWords, StringsKnowNoEscapes) {
  Worldfile wf;
  LoadText(wf, "a \"x\\\" b \"c\\n # (\" c \"\xc3\xa9\"");
  EXPECT_EQ(wf.ReadString(0, "a", ""), "x\\");
  EXPECT_EQ(wf.ReadString(0, "b", ""), "c\\n # (");
  EXPECT_EQ(wf.ReadString(0, "c", ""), "\xc3\xa9");
}

TEST(WorldfileWords, UnterminatedStrings) {
  EXPECT_ERROR("a 1\nname \"foo\nb 2", "t.world:2:6: ", "unterminated string");
  EXPECT_ERROR("name \"foo", "t.world:1:6: ", "the end of the file");
}

TEST(WorldfileWords, CommentsHoldAnything) {
  Worldfile wf;
  LoadText(wf, std::string("a 1 # \xff ( \" [ \0 x\n#\nb 2#", 24));
  EXPECT_EQ(wf.ReadInt(0, "a", 0), 1);
  EXPECT_EQ(wf.ReadInt(0, "b", 0), 2);
}

TEST(WorldfileWords, StrangeBytesAreErrors) {
  for (const char* text : {"a 1,", "a 1;", "a 1=", "a 1{", "a 1:", "a 1/", "a 1\f", "a 1\v", "a 1_",
                           "a 1\xa0", "a 1~"}) {
    EXPECT_ERROR(text, "t.world:1:4: ", "syntax error");
  }
  EXPECT_ERROR("_a 1", "t.world:1:1: ", "syntax error");
  EXPECT_ERROR(std::string("a\0b 1", 5), "t.world:1:2: ", "byte 0x00");
  EXPECT_ERROR(std::string("a 1\0", 4), "t.world:1:4: ", "byte 0x00");
  EXPECT_ERROR(std::string("a \"x\0y\"", 7), "t.world:1:5: ", "byte 0x00");
}

TEST(WorldfileWords, EveryLineEndCountsOnce) {
  for (const char* text : {"a 1\n\n,", "a 1\r\r,", "a 1\r\n\r\n,", "a 1\n\r\n\r,"}) {
    EXPECT_ERROR(text, "t.world:3:1: ", "','");
  }
}

TEST(WorldfileWords, PlacesInLongFilesAreCorrect) {
  std::string text;
  for (int i = 0; i < 9999; ++i) text += i % 3 == 0 ? "a 1\r\n" : i % 7 == 0 ? "bb 22 \r" : "#\n";
  EXPECT_ERROR(text + "  ,", "t.world:10000:3: ", "','");
  EXPECT_ERROR(std::string(9000, ' ') + ",", "t.world:1:9001: ", "','");
}

TEST(WorldfileWords, ColumnsCountBytes) {
  EXPECT_ERROR("\t\"\xc3\xa9\"", "t.world:1:2: ", "the string");
  EXPECT_ERROR("a \"\xc3\xa9\" ,", "t.world:1:8: ", "','");
}

TEST(WorldfileWords, NoLimitOnLength) {
  const std::string text(100000, 'x');
  Worldfile wf;
  LoadText(wf, "#" + text + "\n" + text + " \"" + text + "\"" + std::string(100000, ' ') + "n " +
                   std::string(100000, '0') + "7");
  EXPECT_EQ(wf.ReadString(0, text.c_str(), ""), text);
  EXPECT_EQ(wf.ReadFloat(0, "n", 0), 7);
  EXPECT_LT(ErrorOf("a \"" + text + "\" ( ").size(), 300U);
}

TEST(WorldfileWords, EmptyFileIsAnEmptyWorld) {
  EXPECT_EQ(TreeOf(""), "");
  EXPECT_EQ(TreeOf(" \t\r\n# nothing"), "");
}

// ---- 2 grammar ----

TEST(WorldfileGrammar, EntitiesAreNumberedByTheirParentheses) {
  EXPECT_EQ(TreeOf("a( b( c() ) d() ) e()"), "a:0 b:1 c:2 d:1 e:0");
  Worldfile wf;
  LoadText(wf, "a(b())");
  EXPECT_STREQ(wf.GetEntityType(0), "");
  EXPECT_EQ(wf.GetEntityParent(0), -1);
  EXPECT_EQ(wf.LookupEntity("b"), 2);
  EXPECT_EQ(wf.LookupEntity("x"), -1);
  EXPECT_STREQ(wf.GetEntityType(99), "");
  EXPECT_EQ(wf.GetEntityParent(-5), -1);
}

TEST(WorldfileGrammar, ManyItemsOnALine) {
  Worldfile wf;
  LoadText(wf, "quit_time 0.1 resolution 0.1 model() position( name \"a\" )");
  EXPECT_EQ(Tree(wf), "model:0 position:0");
  EXPECT_EQ(wf.ReadString(2, "name", ""), "a");
}

TEST(WorldfileGrammar, LinesBetweenNameAndParenthesis) {
  EXPECT_EQ(TreeOf("a # comment\n\n  (b\n#x\n())"), "a:0 b:1");
}

TEST(WorldfileGrammar, PropertyAndEntityOfTheSameName) {
  Worldfile wf;
  LoadText(wf, "a 3 a( a 4 )");
  EXPECT_EQ(wf.ReadInt(0, "a", 0), 3);
  EXPECT_EQ(wf.ReadInt(1, "a", 0), 4);
}

TEST(WorldfileGrammar, ValuesStandOnTheirNamesLine) {
  EXPECT_ERROR("m( a \n 1 )", "t.world:1:6: ", "the end of the line");
  EXPECT_ERROR("m( a # c\n 1 )", "t.world:1:6: ", "a comment");
  EXPECT_ERROR("a [1 2\n 3]", "t.world:1:7: ", "the end of the line");
  EXPECT_ERROR("a [1 #x\n 3]", "t.world:1:6: ", "a comment");
  EXPECT_ERROR("a [1 2\n]", "t.world:1:7: ", "the end of the line");
}

TEST(WorldfileGrammar, Mistakes) {
  EXPECT_ERROR(")", "t.world:1:1: ", "found ')'");
  EXPECT_ERROR("3", "t.world:1:1: ", "the number 3");
  EXPECT_ERROR("[", "t.world:1:1: ", "found '['");
  EXPECT_ERROR("\"x\"", "t.world:1:1: ", "the string \"x\"");
  EXPECT_ERROR("m( name foo )", "t.world:1:9: ", "the word \"foo\"");
  EXPECT_ERROR("m( player\n)", "t.world:2:1: ", "after \"player\"");
  EXPECT_ERROR("m( 3 )", "t.world:1:4: ", "the number 3");
  EXPECT_ERROR("m( ] )", "t.world:1:4: ", "found ']'");
  EXPECT_ERROR("m( a [1 b] )", "t.world:1:9: ", "the word \"b]\"");
  EXPECT_ERROR("m( a [1 [2] ] )", "t.world:1:9: ", "found '['");
  EXPECT_ERROR("m( a [1 ) )", "t.world:1:9: ", "found ')'");
  EXPECT_ERROR("m( a 1\n", "t.world:2:1: ", "missing ')'");
  EXPECT_ERROR("m( a [1", "t.world:1:8: ", "the end of the file");
  EXPECT_ERROR("m", "t.world:1:2: ", "the end of the file");
  EXPECT_ERROR("m( define a b() )", "t.world:1:11: ", "the word \"a\"");
}

TEST(WorldfileGrammar, ExtraParenthesisIsAnError) {
  EXPECT_ERROR("model( mass 1 ( mass 3 )", "t.world:1:15: ", "found '('");
}

TEST(WorldfileGrammar, TheLastOfTwoPropertiesWins) {
  Worldfile wf;
  LoadText(wf, "m( size [9 9 9] a 1 size [1 2] )");
  EXPECT_EQ(wf.TupleLength(1, "size"), 2U);
  EXPECT_EQ(wf.ReadFloat(1, "size", 0), 1);
}

TEST(WorldfileGrammar, NamesAreCaseSensitive) {
  Worldfile wf;
  LoadText(wf, "Mass 3");
  EXPECT_FALSE(wf.PropertyExists(0, "mass"));
}

// ---- 3 macros ----

TEST(WorldfileMacros, ChildrenComeBaseFirst) {
  EXPECT_EQ(TreeOf("define b model( x() ) define d b( y() ) d( z() )"), "model:0 x:1 y:1 z:1");
}

TEST(WorldfileMacros, TheMostDerivedPropertyWins) {
  Worldfile wf;
  LoadText(wf, "define b model( p 1 q 1 r 1 ) define d b( q 2 r 2 ) d( r 3 ) b()");
  EXPECT_EQ(wf.ReadInt(1, "p", 0), 1);
  EXPECT_EQ(wf.ReadInt(1, "q", 0), 2);
  EXPECT_EQ(wf.ReadInt(1, "r", 0), 3);
  EXPECT_EQ(wf.ReadInt(2, "r", 0), 1);
}

TEST(WorldfileMacros, NamesAreLookedUpAtUse) {
  EXPECT_EQ(TreeOf("define d b( y() ) define y ranger() define b model( ) d()"),
            "model:0 ranger:1");
  EXPECT_EQ(TreeOf("d() define d model() d()"), "d:0 model:0");
  // A name may be redefined later, even if a macro that was already used refers to it.
  EXPECT_EQ(TreeOf("define r model( s() ) define q r() q() define s ranger() q()"),
            "model:0 s:1 model:0 ranger:3");
  EXPECT_EQ(TreeOf("define r model() r() define model position() r() model()"),
            "model:0 position:0 position:0");
}

TEST(WorldfileMacros, TheFirstDefinitionStays) {
  Worldfile wf;
  LoadText(wf, "define m model( a 1 )\ndefine m ranger( a 2 )\nm()");
  EXPECT_EQ(Tree(wf), "model:0");
  EXPECT_EQ(wf.ReadInt(1, "a", 0), 1);
  ASSERT_EQ(wf.warnings().size(), 1U);
  EXPECT_EQ(wf.warnings()[0].rfind("t.world:2:8: warning: macro \"m\"", 0), 0U);
}

TEST(WorldfileMacros, AMacroWithinItsOwnInstanceIsFine) {
  EXPECT_EQ(TreeOf("define m model( x() ) m( m( m() ) )"), "model:0 x:1 model:1 x:3 model:3 x:5");
}

TEST(WorldfileMacros, RecursionIsAnError) {
  EXPECT_ERROR("define model model()\nmodel()", "t.world:2:1: ", "recursive macro");
  EXPECT_ERROR("define a b() define b a()\n a()", "t.world:2:2: ", "recursive macro");
  EXPECT_ERROR("define a model( a() )\na()", "t.world:1:17: ", "\"a\", defined at t.world:1:8");
  EXPECT_ERROR("define a model( b() )\ndefine b a()\nb()", "t.world:1:17: ", "recursive macro");
  EXPECT_EQ(ErrorOf("define model model() position()"), "");
}

TEST(WorldfileMacros, MistakesInDefinitions) {
  EXPECT_ERROR("define a b c ( )", "t.world:1:12: ", "extra tokens in macro definition");
  EXPECT_ERROR("\ndefine a\n( x 1 )", "t.world:2:1: ", "missing name in macro definition");
  EXPECT_ERROR("define ( )", "t.world:1:1: ", "missing name in macro definition");
  EXPECT_ERROR("define a b )", "t.world:1:12: ", "misplaced ')'");
  EXPECT_ERROR("define a 3 b ( )", "t.world:1:10: ", "the number 3");
  EXPECT_ERROR("define a \"b\" ( )", "t.world:1:10: ", "the string \"b\"");
  EXPECT_ERROR("define a b", "t.world:1:11: ", "missing ')'");
  EXPECT_ERROR("define a b ( c (\n) ", "t.world:2:3: ", "missing ')'");
  EXPECT_EQ(ErrorOf("define a # x\n b\n # y\n ( )"), "");
}

TEST(WorldfileMacros, MistakesInABodyMatterWhenUsed) {
  EXPECT_ERROR("define a b( x\n y )\na()", "t.world:2:2: ", "the word \"y\"");
  Worldfile wf;
  LoadText(wf, "define a b( x y( z 1 ) )\nm( p 1 )");
  EXPECT_EQ(Tree(wf), "m:0");
  EXPECT_EQ(wf.warnings().size(), 1U);
}

TEST(WorldfileMacros, LinesAreCorrectAfterADefine) {
  EXPECT_ERROR("define a b\n(\n\n)\nm\n(\n x y )", "t.world:7:4: ", "the word \"y\"");
}

// ---- limits ----

TEST(WorldfileLimits, BillionLaughs) {
  std::string text = "define m0 model( )\n";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "m" + std::to_string(i - 1) + "() ";
    text += "define m" + std::to_string(i) + " model( " + before + before + ")\n";
  }
  EXPECT_ERROR(text + "m39()", "t.world:41:1: ", "macro \"m39\"");
}

// Macros may multiply entities only up to a limit, which grows with the entities written in the
// file.
TEST(WorldfileLimits, EntitiesThatMacrosMake) {
  std::string text = "define m0 model( )\n";
  for (int i = 1; i <= 14; ++i) {
    const std::string before = "m" + std::to_string(i - 1) + "() ";
    text += "define m" + std::to_string(i) + " model( " + before + before + ")\n";
  }
  Worldfile wf;
  LoadText(wf, text + "m13()");
  EXPECT_EQ(wf.GetEntityCount(), 1 << 14);
  EXPECT_ERROR(text + "m14()", "t.world:16:1: ", "more than 26450 entities");
  for (int i = 0; i < 200; ++i) text += "model() ";
  LoadText(wf, text + "m14()");
  EXPECT_EQ(wf.GetEntityCount(), 200 + (1 << 15));
}

TEST(WorldfileLimits, Nesting) {
  std::string open, close;
  for (int i = 0; i < 100000; ++i) open += "m(", close += ")";
  EXPECT_ERROR(open + close, "t.world:1:201: ", "nested more than 100 deep");
  EXPECT_ERROR(open, "t.world:1:201: ", "nested more than 100 deep");
  std::string chain = "define m0 model()\n";
  for (int i = 1; i < 3000; ++i) {
    chain += "define m" + std::to_string(i) + " model( m" + std::to_string(i - 1) + "() )\n";
  }
  EXPECT_ERROR(chain + "m2999()", "t.world:", "nested more than 100 deep");
  std::string bases = "define m0 model()\n";
  for (int i = 1; i < 3000; ++i) {
    bases += "define m" + std::to_string(i) + " m" + std::to_string(i - 1) + "()\n";
  }
  EXPECT_ERROR(bases + "m2999()", "t.world:3001:1: ", "more than 30 macros");
}

std::string Repeated(int times, const std::string& text) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

TEST(WorldfileLimits, Words) {
  EXPECT_EQ(ErrorOf(Repeated(1249999, "a 1 ")), "");
  EXPECT_ERROR(Repeated(1250001, "a 1 "), "t.world:1:5000001: ", "more than 2500000 words");
}

TEST(WorldfileLimits, TheLengthOfAWord) {
  EXPECT_EQ(ErrorOf("a \"" + std::string(262141, 'x') + "\""), "");
  EXPECT_ERROR("a \"" + std::string(262142, 'x') + "\"", "t.world:1:3: ", "of 262144 bytes");
  EXPECT_ERROR(std::string(300000, 'x') + " 1", "t.world:1:1: ", "at most 262143");
}

TEST(WorldfileLimits, Text) {
  EXPECT_EQ(ErrorOf("#" + std::string(20 << 20, 'x').substr(1)), "");
  EXPECT_ERROR("#" + std::string(20 << 20, 'x'), "t.world: ", "more than 20 MiB of text");
}

TEST(WorldfileLimits, Names) {
  std::string text = "model( ";
  for (int i = 0; i < 151000; ++i) text += "a" + std::to_string(i) + " 1 ";
  EXPECT_ERROR(text + ")", "t.world:1:", "more than 150000 different names");
}

TEST(WorldfileLimits, Macros) {
  std::string text;
  for (int i = 0; i < 10000; ++i) text += "define m" + std::to_string(i) + " model()\n";
  EXPECT_EQ(ErrorOf(text), "");
  EXPECT_ERROR(text + "define n model()", "t.world:10001:8: ", "more than 10000 macros");
}

// Unused properties are searched in every entity. The time must not grow with the product of their
// numbers.
TEST(WorldfileLimits, UnusedPropertiesOfManyEntities) {
  std::string macros = "define a model( ";
  for (int i = 0; i < 20000; ++i) macros += "p" + std::to_string(i) + " 1 ";
  macros += ")\ndefine b a( ";
  for (int i = 0; i < 20000; ++i) macros += "p" + std::to_string(i) + " 1 ";
  Worldfile wf;
  LoadText(wf, macros + ")\n" + Repeated(20000, "b() a( p0 2 )\n"));
  const std::vector<UnusedProperty> unused = wf.Unused();
  ASSERT_EQ(unused.size(), 1000U);
  EXPECT_EQ(unused[0].name, "p1");  // both instances override the macro's p0
  EXPECT_EQ(unused[0].line, 1);
}

// ---- whole files ----

TEST(WorldfileSamples, StageRegressionFiles) {
  const char* shared = std::getenv("STAGE_SHARED_DIR");
  if (shared == nullptr) GTEST_SKIP() << "STAGE_SHARED_DIR is not set";
  const std::string folder = std::string(shared) + "/stage-worlds/tests/";
  // These are the correct lines. Stage 4.3 counts a line end between a name and its '(' twice.
  const std::vector<std::pair<std::string, int>> files{
      {"include-02", 9}, {"syntax-01", 0},  {"syntax-02", 14}, {"syntax-03", 19}, {"syntax-04", 16},
      {"syntax-05", 16}, {"syntax-06", 12}, {"syntax-07", 9},  {"macro-01", 0},   {"macro-02", 0}};
  for (const auto& [name, line] : files) {
    const std::string path = folder + name + ".world";
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is missing";
    Worldfile wf;
    std::string error;
    try {
      wf.Load(path);
    } catch (const LoadError& caught) {
      error = caught.what();
    }
    const std::string start = line == 0 ? "" : path + ":" + std::to_string(line) + ":";
    EXPECT_EQ(error.substr(0, start.size()), start) << error;
    EXPECT_EQ(error.empty(), line == 0) << error;
  }
}

TEST(WorldfileSamples, MutatedTextsLoadOrThrow) {
  const std::vector<std::string> seeds{
      "name \"w\" unit_length \"cm\"\nmodel( pose [1 2 0 90] mass \"3\" color \"red\" )\n",
      // NOLINTNEXTLINE(bugprone-suspicious-missing-comma): one text on two lines
      "define s sensor( range [0 5] fov 30 )\ndefine r position( ranger( s() s( samples 3 ) ) )\n"
      "r( name \"a\" pose [0 0 0 0] )\nr( size [1 1 1] r( ) )\n",
      "# comment\r\nblock( points 3 point[0] [0 0] point[1] [1 0] z [0 1] )\nwindow( size [1 2] "
      ")\n",
      "define a b( x 1 ) define b a( y 2 ) define c model( c() )\nmodel() # end",
      "include \"nothing.inc\" # x\nm( a .5 b -3 c 1.2.3 d \"1e3\" e 9e-06 )"};
  const std::string alphabet("()[]\"#\n\r\t .+-09azAZ_\\,\0\xff", 24);
  RandomStream random(2024);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random.Next() % n); };
  int loaded = 0, refused = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string text = seeds[below(seeds.size())];
    for (std::size_t edits = 1 + below(6); edits > 0 && !text.empty(); --edits) {
      const std::size_t at = below(text.size());
      const std::size_t length = 1 + below(8);
      switch (below(4)) {
        case 0:
          text[at] = alphabet[below(alphabet.size())];
          break;
        case 1:
          text.erase(at, length);
          break;
        case 2:
          text.insert(at, text.substr(below(text.size()), length * 3));
          break;
        default:
          text.insert(at, 1, alphabet[below(alphabet.size())]);
          break;
      }
    }
    Worldfile wf;
    try {
      LoadText(wf, text);
      ++loaded;
      for (int entity = 0; entity < wf.GetEntityCount(); ++entity) {
        double x = 0;
        wf.ReadInt(entity, "mass", 0);
        wf.ReadTuple(entity, "pose", 0, 1, "l", &x);
      }
      wf.Unused();
    } catch (const LoadError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).rfind("t.world:", 0), 0U) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(loaded, 1000);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace Stg
