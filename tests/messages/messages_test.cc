// SPDX-License-Identifier: GPL-2.0-or-later
//
// Messages about unusual world files, file names and options: for any content, the output is safe
// for a terminal and short enough to read.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/cli_testing.hh"
#include "support/json.hh"
#include "support/odd_names.hh"

namespace {

using namespace cli_testing;
using odd_names::kEvil;
using odd_names::WhyUnfit;

/// Every place of a world file that takes a string; @ is replaced by the string.
const char* const kTexts[] = {
    "name \"@\"",
    "unit_length \"@\"",
    "unit_angle \"@\"",
    "ray_model \"@\"",
    "threads \"@\"",
    "interval_sim \"@\"",
    "quit_time \"1@\"",
    "include \"@\"",
    "include \"/@\"",
    "include \"empty.inc\" @",
    "model( name \"@\" debug 1 )",
    "model( name \"/@\" model( name \"@\" debug 1 ) )",
    "model( name \"@\" name2 1 ctrl \"none\" )",
    "model( ctrl \"@\" )",
    "model( ctrl \"/@\" )",
    "model( ctrl \"folder/@ x\" )",
    "model( ctrl [ \"none @\" \"@ none\" ] )",
    "position( name \"@\" ctrl \"wander @\" )",
    "position( name \"@\" ctrl \"disperse @\" )",
    "position( name \"@\" ctrl \"disperse speed=@\" )",
    "position( name \"@\" ctrl \"sink @\" )",
    "position( name \"@\" ctrl \"source @\" )",
    "position( name \"@\" ctrl \"fasr @\" ranger( sensor( samples 9 ) ) )",
    "position( name \"@\" ctrl \"fasr2 @\" )",
    "model( bitmap \"@\" )",
    "model( bitmap \"/@\" )",
    "model( bitmap \"empty.inc\" name \"@\" )",
    "model( color \"@\" )",
    "model( say \"@\" mass \"@\" )",
    "model( pose [ \"@\" 0 0 0 ] )",
    "model( pose [ \"@\" 0 ] )",
    "model( pose \"@\" size \"inf@\" )",
    "model( update_interval \"@\" watts \"1e999\" )",
    "model( name \"@\" kjoules \"1e306\" )",
    "model( name \"@\" joules 1 alwayson 1 )",
    "model( name \"@\" block( points \"@\" ) )",
    "position( drive \"@\" localization \"@\" )",
    "position( name \"@\" alwayson 1 ranger( name \"@\" sensor( range [ 0 5 ] samples 9 ) ) )",
    "ranger( alwayson 1 ray_model \"@\" )",
    "ranger( alwayson 1 sensor( range [ \"@\" 5 ] color \"@\" samples \"@\" ) )",
    "blobfinder( colors_count 1 colors [ \"@\" ] alwayson 1 name \"@\" )",
    "fiducial( name \"@\" alwayson 1 range_max \"@\" )",
    "actuator( type \"@\" axis [ \"@\" 0 0 ] )",
    "gripper( paddle_state [ \"@\" \"@\" ] )",
    "wifi( model \"@\" essid \"@\" mac \"@\" ip \"@\" )",
    "camera( name \"@\" resolution [ \"@\" 32 ] )",
    "window( size [ \"@\" 100 ] follow_model \"@\" )",
    "model( window( ) ranger( name \"@\" sensor( sensor( name \"@\" ) ) ) )",
    "@",
    "\"@\"",
    "model( @ )",
    "model( mass @ )",
    "model( mass 1@ )",
    "include @",
    "define @ model( )",
};

/// Places that take a word, tested with long words only.
const char* const kWords[] = {
    "@( )",
    "model( @( ) )",
    "model( @ 1 )",
    "@ 1",
    "define @ model( ) @( )",
    "define a @( ) a( )",
    "define @ @( ) @( )",
    "define @ model( ) define @ model( )",
    "define @ model( mass ) @( )",
    "model( mass 0x@ )",
    "model( mass 1e3@ )",
    "model( mass 1@ 1 )",
    "window( @ 1 )",
    "model( block( points 1 @ 2 ) )",
    "ranger( sensor( @( ) ) )",
    "model( @[1 2 3] )",
};

class Messages : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    Write("empty.inc", "");
  }

  /// Runs a world and checks the output.
  void Check(const std::string& world, const Strings& arguments) {
    SCOPED_TRACE(world.substr(0, 100) + testing::PrintToString(arguments).substr(0, 300));
    const Result r = Stage(arguments);
    EXPECT_TRUE(r.status < 128 || r.status == 255) << r.status << r.err;
    // Folder names in the message may add to the limit, which is that of the list of model types.
    const char* const build = std::getenv("STAGE_BINARY_DIR");
    const std::size_t longest =
        360 + directory_.string().size() + std::string(build ? build : "").size();
    EXPECT_EQ(WhyUnfit(r.err, longest, "\n"), "") << r.err.substr(0, 2000);
    EXPECT_EQ(WhyUnfit(r.out, 10000, "\r\n"), "") << r.out.substr(0, 2000);
    said_ += !r.err.empty();
  }

  void CheckAll(const std::vector<const char*>& worlds, const std::string& name) {
    for (std::string world : worlds) {
      for (size_t at = world.find('@'); at != std::string::npos;
           at = world.find('@', at + name.size()))
        world.replace(at, 1, name);
      Write("w.world", world + "\n");
      for (const Strings& options : {Strings{"-g", "-c", "--progress"},
                                     Strings{"-g", "--stats", "-"}, Strings{"--explain"}}) {
        Strings arguments = options;
        if (options[0] == "-g") arguments.insert(arguments.end(), {"--duration", "0.2"});
        arguments.push_back("w.world");
        Check(world, arguments);
      }
    }
  }

  int said_ = 0;
};

TEST_F(Messages, EscapeControlCharacters) {
  CheckAll({std::begin(kTexts), std::end(kTexts)}, kEvil);
  EXPECT_GT(said_, 100);
}

TEST_F(Messages, OfLongTexts) {
  CheckAll({std::begin(kTexts), std::end(kTexts)}, std::string(100000, 'x'));
  EXPECT_GT(said_, 100);
}

TEST_F(Messages, OfLongWords) {
  CheckAll({std::begin(kWords), std::end(kWords)}, std::string(262000, 'x'));
  EXPECT_GT(said_, 40);
}

// The longest names that are valid for models.
TEST_F(Messages, OfModelsWithTheLongestNames) {
  CheckAll({std::begin(kTexts), std::end(kTexts)}, std::string(990, 'x'));
}

TEST_F(Messages, OfFilesWithOddNames) {
  const std::string odd = kEvil + "\nb";
  for (const char* text : {"model( )", "model( ", "model( mass \"x\" )", "include \"none\"",
                           "none( )", "name \"\" position( alwayson 1 )"}) {
    Write(odd + ".world", text);
    for (const Strings& options : {Strings{"-g", "--progress"}, Strings{"-g", "--stats", "-"},
                                   Strings{"--explain"}, Strings{"--explain=json"}}) {
      Strings arguments = options;
      if (options[0] == "-g") arguments.insert(arguments.end(), {"--duration", "0.2"});
      arguments.push_back(odd + ".world");
      Check(text, arguments);
    }
  }
  EXPECT_GT(said_, 10);
}

TEST_F(Messages, OfOptions) {
  Write("w.world", "quit_time 0.2 position( ctrl \"wander\" )");
  for (const std::string& name : {kEvil + "\nb", std::string(100000, 'x')}) {
    for (const Strings& options :
         {Strings{"--" + name}, Strings{"--seed", name}, Strings{"--threads=" + name},
          Strings{"--duration", name}, Strings{"--stats", name + "/x"},
          Strings{"--ray-model", name}, Strings{"--explain=" + name},
          Strings{"--screenshot", name + "/x.png"}, Strings{"--args", name},
          Strings{"--opencl=" + name}, Strings{name}, Strings{"folder/" + name}}) {
      Strings arguments = {"-g", "w.world"};
      arguments.insert(arguments.end(), options.begin(), options.end());
      Check("w.world", arguments);
    }
  }
  EXPECT_GT(said_, 15);
}

TEST_F(Messages, KeepNamesInJson) {
  Write("w.world", "name \"w\" position( name \"" + kEvil + "\" alwayson 1 ranger( ) )");
  const Result r = Stage({"--explain=json", "w.world"});
  EXPECT_EQ(WhyUnfit(r.out, 10000, "\n"), "");
  EXPECT_FALSE(nlohmann::json::parse(r.out)["sensors"].empty());
}

TEST_F(Messages, ReportEmptyNamesWithTheirPlace) {
  for (const char* name : {"", "/"}) {
    Write("w.world", std::string("model(\n name \"") + name + "\" )");
    const Result r = Stage({"-g", "--duration", "0.1", "w.world"});
    EXPECT_EQ(r.status, 0);
    EXPECT_EQ(r.err, "w.world:2:7: warning: found an empty name, the model keeps \"model:1\"\n");
  }
}

}  // namespace
