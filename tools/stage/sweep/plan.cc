// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/plan.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "random/fnv1a.hh"
#include "random/random.hh"
#include "stage/option_json.hh"
#include "stage/option_values.hh"
#include "stage/sweep/json_text.hh"
#include "worldfile/worldfile.hh"

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

/// Derives the seed from the varied values; independent of the order of --set.
uint64_t SeedOf(const Plan& plan, const RunSpec& spec) {
  std::vector<std::pair<std::string, std::string>> sorted;
  if (!plan.common_seeds) sorted = spec.set;
  std::ranges::sort(sorted);
  std::string canonical;
  for (const auto& [name, value] : sorted) canonical += name + "=" + value + "\n";
  return MixSeeds(MixSeeds(plan.run.seed, Fnv1a(canonical)), spec.run) >> 11;
}

/// Quotes text with single quotes if a shell would not read it as one word.
std::string ShellWord(const std::string& text) {
  constexpr char kPlain[] =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=:,@%+";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

const char* NameOfCompression(recording::Compression compression) {
  return compression == recording::Compression::kNone ? "none" : recording::NameOf(compression);
}

const char* NameOf(recording::RangeConvention ranges) {
  return ranges == recording::RangeConvention::kStage ? "stage" : "rep117";
}

Json LogToJson(const recording::LogOptions& log) {
  return {{"every", log.every == 0 ? Json() : Json(static_cast<double>(log.every) / 1e6)},
          {"models", log.robots},
          {"compression", NameOfCompression(log.compression)},
          {"ranges", NameOf(log.ranges)}};
}

recording::LogOptions LogOf(const Json& json) {
  recording::LogOptions log;
  if (!json.at("every").is_null())
    log.every = static_cast<usec_t>(std::llround(json.at("every").get<double>() * 1e6));
  log.robots = json.at("models").get<std::vector<std::string>>();
  log.compression = ParseCompression("the sweep's log", json.at("compression"));
  // Plans of earlier states of this version have no such option.
  if (json.contains("ranges")) log.ranges = ParseRanges("the sweep's log", json.at("ranges"));
  return log;
}

/// True for options that all runs have alike. Others have their own places in the plan.
bool IsShared(const RunOption& option) {
  return option.of_world && option.name != std::string_view("seed") &&
         option.type != RunOption::Type::kTexts;
}

void ReadOptions(const Json& options, Plan* plan) {
  plan->controller_args = options.at("args");
  for (const RunOption& option : RunOptionTable())
    if (IsShared(option) && options.contains(option.name))  // plans of earlier states lack some
      FromJson(options.at(option.name), option, &plan->run);
  if (!options.at("worker").is_null()) plan->worker = options.at("worker");
  if (!options.at("log").is_null()) plan->log = LogOf(options.at("log"));
}

/// Returns where the value ends that starts at `begin`: at a comma outside of quotes and brackets.
size_t EndOfValue(const std::string& text, size_t begin) {
  int brackets = 0;
  bool quoted = false;
  size_t end = begin;
  for (; end < text.size(); end++) {
    const char c = text[end];
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    brackets += c == '[' ? 1 : c == ']' ? -1 : 0;
    if (c == ',' && brackets <= 0) break;
  }
  return end;
}

}  // namespace

uint64_t Plan::Count() const {
  uint64_t count = RunsEach();
  for (const Axis& axis : axes) {
    if (count > kMaxRuns) break;  // too many runs, but no overflow yet
    count *= axis.values.size();
  }
  return count;
}

Axis ParseAxis(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos)
    RefuseValue("--set", "NAME=VALUE,VALUE, as in robots=10,100", text);
  Axis axis{text.substr(0, equals), {}};
  for (size_t begin = equals + 1; begin <= text.size();) {
    const size_t end = EndOfValue(text, begin);
    if (end == begin) RefuseValue("--set", "a value before and after each comma", text);
    const std::string value = text.substr(begin, end - begin);
    if (std::ranges::find(axis.values, value) != axis.values.end())
      RefuseValue("--set", "each value once", text);
    axis.values.push_back(value);
    begin = end + 1;
  }
  return axis;
}

RunSpec RunAt(const Plan& plan, uint64_t index) {
  if (index >= plan.Count()) throw std::runtime_error("found a run that the sweep lacks");
  RunSpec spec;
  spec.index = index;
  spec.run = plan.first + index % plan.RunsEach();
  uint64_t combination = index / plan.RunsEach();
  for (size_t i = plan.axes.size(); i-- > 0;) {
    const Axis& axis = plan.axes[i];
    spec.set.emplace_back(axis.name,
                          axis.values[static_cast<size_t>(combination % axis.values.size())]);
    combination /= axis.values.size();
  }
  std::ranges::reverse(spec.set);
  spec.seed = SeedOf(plan, spec);
  return spec;
}

std::vector<std::string> SettingsOf(const RunSpec& spec) {
  std::vector<std::string> settings;
  for (const auto& [name, value] : spec.set) {
    settings.push_back(name);
    settings.back() += '=' + value;
  }
  return settings;
}

RunOptions RunOptionsOf(const Plan& plan, const RunSpec& spec) {
  RunOptions options = plan.run;
  options.seed = spec.seed;
  options.settings = SettingsOf(spec);
  return options;
}

std::string ReplayCommand(const Plan& plan, const RunSpec& spec) {
  const RunOptions options = RunOptionsOf(plan, spec);
  std::string command = "stage -g";
  for (const RunOption& option : RunOptionTable()) {
    if (!option.changes_results) continue;
    for (const auto& [flag, value] : option.Arguments(options))
      command += " " + flag + (value.empty() ? "" : " " + ShellWord(value));
  }
  if (!plan.controller_args.empty()) command += " --args " + ShellWord(plan.controller_args);
  return command + " --state-hash " + ShellWord(plan.world);
}

std::string DigestOf(const std::string& world) {
  Worldfile file;
  file.Load(world);
  uint64_t hash = 0;
  for (const Worldfile::Text& text : file.Texts()) hash = MixSeeds(hash, Fnv1a(text.text));
  char digits[20];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(hash));
  return digits;
}

std::string ToJson(const Plan& plan) {
  Json axes = Json::array();
  for (const Axis& axis : plan.axes) axes.push_back({{"name", axis.name}, {"values", axis.values}});
  Json options = {{"args", plan.controller_args}};
  for (const RunOption& option : RunOptionTable())
    if (IsShared(option)) options[option.name] = ToJson(option.get(plan.run));
  options["worker"] = plan.worker.empty() ? Json() : Json(plan.worker);
  options["log"] = plan.log ? LogToJson(*plan.log) : Json();
  const Json json = {{"program", "stage sweep"},
                     {"format", kFormat},
                     {"version", Version()},
                     {"world", plan.world},
                     {"world_digest", plan.digest},
                     {"axes", axes},
                     {"runs", {plan.first, plan.last}},
                     {"seed", plan.run.seed},
                     {"common_seeds", plan.common_seeds},
                     {"duration", ToJson(FindRunOption("duration").get(plan.run))},
                     {"options", options},
                     {"count", plan.Count()}};
  return ToJsonText(json, 2) + "\n";
}

Plan ReadPlan(const std::string& text) try {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    throw std::runtime_error(
        "found an empty file; the disk was full, or the system has crashed, when "
        "it was written: begin the sweep again");
  const Json json = ParseJsonText(text);
  if (json.at("program") != "stage sweep" || json.at("format") != kFormat)
    throw std::runtime_error("found another format");
  Plan plan;
  plan.world = json.at("world");
  plan.digest = json.at("world_digest");
  for (const Json& axis : json.at("axes"))
    plan.axes.push_back({axis.at("name"), axis.at("values").get<std::vector<std::string>>()});
  plan.first = json.at("runs").at(0);
  plan.last = json.at("runs").at(1);
  plan.run.seed = json.at("seed");
  plan.common_seeds = json.at("common_seeds");
  FromJson(json.at("duration"), FindRunOption("duration"), &plan.run);
  ReadOptions(json.at("options"), &plan);
  const bool empty =
      plan.last <= plan.first ||
      std::ranges::any_of(plan.axes, [](const Axis& axis) { return axis.values.empty(); });
  if (empty)
    throw std::runtime_error(
        "found a plan without runs, expected at least one value of each axis and "
        "one run");
  if (plan.Count() > kMaxRuns)
    throw std::runtime_error("found more than " + std::to_string(kMaxRuns) +
                             " runs, expected fewer");
  return plan;
} catch (const std::exception& error) {
  throw std::runtime_error(std::string("not the plan of a sweep of this version: ") + error.what());
}

}  // namespace Stg::program
