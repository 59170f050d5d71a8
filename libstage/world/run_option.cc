// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/run_option.hh"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <type_traits>

#include "messages/assert.hh"
#include "models/model_choices.hh"
#include "worldfile/numbers.hh"

namespace Stg {

namespace {

using Type = RunOption::Type;
using Texts = std::vector<std::string>;

constexpr double kMinSeconds = 1e-6,
                 kMaxSeconds = 1e12;  // the latter is well below the maximum of usec_t

/// Reads a member of RunOptions. Numbers that are 0 for "not set" are none.
template <auto kMember>
OptionValue Get(const RunOptions& options) {
  using Member = std::remove_cvref_t<decltype(options.*kMember)>;
  if constexpr (std::is_same_v<Member, int>)
    return options.*kMember == 0 ? OptionValue() : static_cast<uint64_t>(options.*kMember);
  else
    return options.*kMember;
}

template <auto kMember>
void Set(RunOptions* options, const OptionValue& value) {
  using Member = std::remove_cvref_t<decltype(options->*kMember)>;
  using Kept = std::conditional_t<std::is_same_v<Member, int>, uint64_t, Member>;
  const auto* kept = std::get_if<Kept>(&value);
  options->*kMember = kept ? static_cast<Member>(*kept) : Member();
}

OptionValue GetDuration(const RunOptions& options) {
  if (options.duration == 0) return {};
  return static_cast<double>(options.duration) / 1e6;
}

void SetDuration(RunOptions* options, const OptionValue& value) {
  const auto* seconds = std::get_if<double>(&value);
  options->duration = seconds ? static_cast<usec_t>(std::llround(*seconds * 1e6)) : 0;
}

/// Reads a choice by its name; kDefault is none.
template <auto kMember, const ChoiceNames& kNames>
OptionValue GetChoice(const RunOptions& options) {
  const size_t number = static_cast<size_t>(options.*kMember);
  return number == 0 ? OptionValue() : std::string(kNames[number - 1]);
}

template <auto kMember, const ChoiceNames& kNames>
void SetChoice(RunOptions* options, const OptionValue& value) {
  using Choice = std::remove_cvref_t<decltype(options->*kMember)>;
  const auto* name = std::get_if<std::string>(&value);
  options->*kMember = !name                ? Choice::kDefault
                      : *name == kNames[0] ? static_cast<Choice>(1)
                                           : static_cast<Choice>(2);
}

OptionValue GetDevice(const RunOptions& options) {
  return options.opencl ? options.device : OptionValue();
}

void SetDevice(RunOptions* options, const OptionValue& value) {
  const auto* device = std::get_if<std::string>(&value);
  options->opencl = device != nullptr || options->always_on_device;
  options->device = device ? *device : "";
}

void SetAlwaysOnDevice(RunOptions* options, const OptionValue& value) {
  Set<&RunOptions::always_on_device>(options, value);
  options->opencl |= options->always_on_device;
}

std::string TextOf(const OptionValue& value) {
  if (const auto* number = std::get_if<uint64_t>(&value)) return std::to_string(*number);
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  char text[40] = "";  // digits from which the same number is read
  if (const auto* seconds = std::get_if<double>(&value))
    std::snprintf(text, sizeof text, "%.17g", *seconds);
  return text;
}

std::vector<RunOption> MakeTable() {
  return {
      {"seed", "seed", Type::kNumber, "N", true,
       "seed of the random numbers (default 1). Equal seeds give equal runs",
       Get<&RunOptions::seed>, Set<&RunOptions::seed>, 0, std::numeric_limits<uint64_t>::max()},
      {"duration",
       "duration",
       Type::kSeconds,
       "S",
       true,
       "end after S simulated seconds; overrides the world's quit_time. Without either, a world "
       "runs until its controllers or Ctrl-C end it",
       GetDuration,
       SetDuration,
       0,
       0,
       {},
       false},
      {"settings", "set", Type::kTexts, "NAME=VALUE", true,
       "replace a value of the world file. NAME is one of\n"
       "  NAME.PROPERTY   a property of \"world\", of a type such as ranger, of a macro\n"
       "                  such as robot, or of the model of that name\n"
       "  NAME            a population, or else a type. VALUE is the number of its\n"
       "                  models, at random free places instead of those of the file\n"
       "May be given several times: --set world.resolution=0.05 --set robot.ctrl=wander "
       "--set robots=100",
       Get<&RunOptions::settings>, Set<&RunOptions::settings>},
      {"ray_model",
       "ray-model",
       Type::kChoice,
       "cell|exact",
       true,
       "ray model of all sensors that do not set their own; overrides the world's. With cell, "
       "ranges go to the grid cell that was hit, accurate to about one cell; with exact, to the "
       "outline of the body, whatever the size of the cells",
       GetChoice<&RunOptions::ray_model, kRayModels>,
       SetChoice<&RunOptions::ray_model, kRayModels>,
       0,
       0,
       {kRayModels.begin(), kRayModels.end()}},
      {"contacts",
       "contacts",
       Type::kChoice,
       "cells|outlines",
       true,
       "what stops bodies; overrides the world's. With outlines (default), bodies touch, slide "
       "along each other, turn where they touch, and push what is pushable; with cells, as in "
       "Stage 4.3, a move is refused if it would touch a cell of another body",
       GetChoice<&RunOptions::contacts, kContactModels>,
       SetChoice<&RunOptions::contacts, kContactModels>,
       0,
       0,
       {kContactModels.begin(), kContactModels.end()}},
      {"controllers", "no-controllers", Type::kSwitch, "", true,
       "load no controllers and no plug-ins. These are programs: use this option to look at a "
       "world file that you do not trust",
       Get<&RunOptions::controllers>, Set<&RunOptions::controllers>},
      {"threads", "threads", Type::kNumber, "N", false,
       "number of threads, 1 to 1024 (default: that of the world, or else one for each processor "
       "that the program may use, in steps that are faster with them)",
       Get<&RunOptions::threads>, Set<&RunOptions::threads>, 1, 1024},
      {"opencl", "opencl", Type::kDevice, "DEVICE", false,
       "trace sensor rays with an OpenCL device in steps where that is faster, which needs some "
       "ten thousand rays per step. DEVICE is one of\n"
       "  auto            the best device; without any, the run continues (default)\n"
       "  cpu, gpu, accelerator\n"
       "                  the first device of that kind\n"
       "  NAME[:INDEX]    a device whose name contains NAME; the INDEXth, from 0\n"
       "  list            print the available devices and exit: for the program alone",
       GetDevice, SetDevice},
      {"opencl_always", "opencl-always", Type::kSwitch, "", false,
       "use the device in every step, even where it is slower: for measurements",
       Get<&RunOptions::always_on_device>, SetAlwaysOnDevice},
      {"batch", "no-batch", Type::kSwitch, "", false,
       "trace the rays of each sensor separately: for comparisons", Get<&RunOptions::batch>,
       Set<&RunOptions::batch>},
  };
}

}  // namespace

std::string RunOption::Summary() const {
  const std::string_view text = help;
  return std::string(text.substr(0, text.find(". ")));
}

std::string RunOption::Expected() const {
  if (type == Type::kNumber)
    return "a whole number, from " + std::to_string(min) + " to " + std::to_string(max);
  if (type == Type::kSeconds) return "simulated seconds, from 0.000001 to 1e12";
  std::string expected;
  for (const std::string& choice : choices) expected += (expected.empty() ? "" : " or ") + choice;
  return expected;
}

std::string RunOption::Usage() const {
  const std::string start = std::string("--") + flag;
  if (type == Type::kSwitch) return start;
  return type == Type::kDevice ? start + "[=" + placeholder + "]" : start + " " + placeholder;
}

bool RunOption::Parse(const std::string& text, RunOptions* options) const {
  OptionValue value = text;
  if (type == Type::kSwitch) {
    value = !std::get<bool>(Default());
  } else if (type == Type::kNumber) {
    uint64_t number = 0;
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, number);
    if (error != std::errc() || end != last || number < min || number > max) return false;
    value = number;
  } else if (type == Type::kSeconds) {
    const std::optional<double> seconds = worldfile::ReadWholeFloat(text);
    if (!seconds || !(*seconds >= kMinSeconds && *seconds <= kMaxSeconds)) return false;
    value = *seconds;
  } else if (type == Type::kChoice) {
    if (std::ranges::find(choices, text) == choices.end()) return false;
  } else if (type == Type::kTexts) {
    value = get(*options);
    std::get<Texts>(value).push_back(text);
  }
  set(options, value);
  return true;
}

std::vector<std::pair<std::string, std::string>> RunOption::Arguments(
    const RunOptions& options) const {
  const OptionValue value = get(options);
  const std::string start = std::string("--") + flag;
  std::vector<std::pair<std::string, std::string>> arguments;
  if (const auto* texts = std::get_if<Texts>(&value))
    for (const std::string& text : *texts) arguments.emplace_back(start, text);
  else if (value != Default())
    arguments.emplace_back(start, TextOf(value));
  return arguments;
}

const std::vector<RunOption>& RunOptionTable() {
  static const std::vector<RunOption> table = MakeTable();
  return table;
}

const RunOption& FindRunOption(std::string_view name) {
  const auto& table = RunOptionTable();
  const auto found = std::ranges::find(table, name, &RunOption::name);
  STAGE_ASSERT(found != table.end());
  return *found;
}

}  // namespace Stg
