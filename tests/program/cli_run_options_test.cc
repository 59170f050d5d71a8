// SPDX-License-Identifier: GPL-2.0-or-later
//
// Each option of RunOptionTable() in each place that has options: the command line, its help, the
// JSON of runs, sweeps and their replay commands. tests/python/test_options.py has the places in
// Python.

#include "support/cli_testing.hh"
#include "support/json.hh"
#include "world/run_option.hh"

namespace {

using namespace cli_testing;
using Json = nlohmann::json;
using Stg::RunOption;
using Stg::RunOptionTable;
using Type = RunOption::Type;

/// A value of an option: as a word of a command line, and in JSON.
struct Sample {
  std::string word;
  Json json;
};

/// Values that are not the default.
std::vector<Sample> SamplesOf(const RunOption& option) {
  switch (option.type) {
    case Type::kSwitch:
      return {{"", !std::get<bool>(option.Default())}};
    case Type::kNumber:
      return {{"2", 2}, {std::to_string(option.max), option.max}};
    case Type::kSeconds:
      return {{"0.3", 0.3}};
    case Type::kChoice: {
      std::vector<Sample> samples;
      for (const std::string& choice : option.choices) samples.push_back({choice, choice});
      return samples;
    }
    case Type::kDevice:
      return {{"", ""}, {"auto", "auto"}};
    case Type::kTexts:
      return {{"world.resolution=0.05", {"world.resolution=0.05"}}};
  }
  return {};
}

std::string WordOf(const RunOption& option, const Sample& sample) {
  const std::string flag = std::string("--") + option.flag;
  if (option.type == Type::kSwitch || (option.type == Type::kDevice && sample.word.empty()))
    return flag;
  return flag + "=" + sample.word;
}

class RunOptionsTest : public CliTest {
 protected:
  void SetUp() override {
    CliTest::SetUp();
    WriteWorld("w.world", "quit_time 0.2 threads 1 resolution 0.1");
  }

  Json OptionsOfRun(Strings words) const {
    words.insert(words.end(), {"-g", "w.world", "--stats=s.json"});
    const Result r = Stage(words);
    EXPECT_EQ(r.status, 0) << r.err;
    return Stats("s.json")["options"];
  }
};

TEST_F(RunOptionsTest, CommandLineSetsTheOptionAndNoOtherOne) {
  const Json defaults = OptionsOfRun({});
  ASSERT_EQ(defaults.size(), RunOptionTable().size());
  for (const RunOption& option : RunOptionTable()) {
    if (option.name == std::string("threads")) continue;  // 1024 threads in each run take long
    for (const Sample& sample : SamplesOf(option)) {
      Json expected = defaults;
      expected[option.name] = sample.json;
      if (option.name == std::string("opencl_always")) expected["opencl"] = "";
      EXPECT_EQ(OptionsOfRun({WordOf(option, sample)}), expected) << option.name << sample.word;
    }
  }
  EXPECT_EQ(OptionsOfRun({"--threads=2"})["threads"], 2);
}

TEST_F(RunOptionsTest, ValuesOutOfRangeAreRefusedWithTheRange) {
  for (const RunOption& option : RunOptionTable()) {
    Strings wrong;
    if (option.type == Type::kNumber)
      wrong = {"", "x", "-1", "1.5", std::to_string(option.max) + "0"};
    if (option.type == Type::kNumber && option.min > 0) wrong.emplace_back("0");
    if (option.type == Type::kSeconds) wrong = {"", "x", "0", "-1", "1e13", "nan"};
    if (option.type == Type::kChoice) wrong = {"", "x", option.choices[0] + "x"};
    for (const std::string& word : wrong)
      for (const char* command : {"-g", "sweep"}) {
        const Result r = Stage({command, "w.world", std::string("--") + option.flag + "=" + word});
        EXPECT_EQ(r.status, 2);
        EXPECT_TRUE(Contains(r.err, std::string("--") + option.flag + ": found '" + word +
                                        "', expected " + option.Expected()))
            << r.err;
      }
  }
}

TEST_F(RunOptionsTest, HelpDescribesTheOption) {
  const std::string help = Stage({"--help"}).out, sweep = Stage({"sweep", "--help"}).out;
  const auto words = [](std::string text) {
    text.erase(std::unique(text.begin(), text.end(),
                           [](char a, char b) { return std::isspace(a) && std::isspace(b); }),
               text.end());
    std::ranges::replace(text, '\n', ' ');
    return text;
  };
  for (const RunOption& option : RunOptionTable()) {
    EXPECT_TRUE(Contains(words(help), " " + option.Usage() + " " + words(option.help))) << help;
    EXPECT_TRUE(Contains(sweep, std::string("\n  --") + option.flag)) << option.name;
  }
  for (const std::string& text : {help, sweep}) {
    EXPECT_FALSE(Contains(text,
                          "@"
                          "results"))
        << text;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100u) << line;
  }
}

TEST_F(RunOptionsTest, SweepsKeepTheOptionAndReplayItIfItChangesResults) {
  for (const RunOption& option : RunOptionTable())
    for (const Sample& sample : SamplesOf(option)) {
      fs::remove_all(Path("swept"));
      const std::string word = WordOf(option, sample);
      ExpectStatus(0, {"sweep", "w.world", word, "--plan-only", "-o", "swept"});
      const Json plan = Json::parse(ReadFile(Path("swept/sweep.json")));
      const std::string name = option.name,
                        replay = Stage({"sweep", "w.world", word, "--dry-run"}).out;
      if (name == "settings") {
        EXPECT_EQ(plan["axes"][0]["values"][0], "0.05");
      } else {
        EXPECT_EQ((name == "seed" || name == "duration" ? plan : plan["options"])[name],
                  sample.json);
      }
      EXPECT_EQ(Contains(replay, std::string(" --") + option.flag), option.changes_results)
          << replay;
      EXPECT_EQ(Stage({"sweep", "--resume", "swept", word}).status, 2);
    }
}

}  // namespace
