// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/options.hh"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>
#include <string_view>
#include <type_traits>
#include <utility>

#include "files/whole_file.hh"
#include "stage/command_line.hh"
#include "stage/option_values.hh"
#include "stage/parse_number.hh"

namespace Stg::program {

namespace {

using Action = Options::Action;
using Text = const std::string&;

constexpr int kMaxPixels = 16384;  // maximum side of an image
constexpr usec_t kAtTheEnd = std::numeric_limits<usec_t>::max();
constexpr usec_t kShotTime = 1000000;  // for runs without an end

/// A file and the simulated time at which it is written.
struct TimedFile {
  std::string file;
  std::optional<double> seconds;  ///< empty if no number follows an @

  bool IsInRange() const { return *seconds >= 0 && *seconds <= kMaxDuration; }
  usec_t Time() const { return static_cast<usec_t>(std::llround(*seconds * 1e6)); }
};

/// Splits FILE@SECONDS. Names may contain an @, so a text without a number after the last one is
/// a FILE.
TimedFile SplitTimedFile(Text text) {
  const size_t at = text.rfind('@');
  if (at == std::string::npos) return {text, std::nullopt};
  const std::optional<double> seconds = ParseNumber<double>(text.substr(at + 1));
  return {seconds ? text.substr(0, at) : text, seconds};
}

/// Parses FILE@SECONDS.
Options::SnapshotOrder ParseSnapshotOrder(Text name, Text text) {
  const TimedFile found = SplitTimedFile(text);
  if (found.file.empty() || !found.seconds || !found.IsInRange())
    RefuseValue(name, "FILE@SECONDS, as cave.snapshot@60", text);
  return {found.file, found.Time()};
}

/// Parses FILE.png or FILE.png@SECONDS.
offscreen::PictureOptions::Shot ParseShot(Text name, Text text) {
  const TimedFile found = SplitTimedFile(text);
  if (found.seconds && !found.IsInRange())
    RefuseValue(name, "simulated seconds after the @, from 0 to 1e12", text);
  if (found.file.size() < 5 || !found.file.ends_with(".png"))
    RefuseValue(name, "FILE.png or FILE.png@SECONDS", text);
  return {found.file, found.seconds ? found.Time() : kAtTheEnd};
}

void ParseSize(Text name, Text text, offscreen::PictureOptions* picture_options) {
  const size_t by = std::min(text.find('x'), text.size());
  const std::optional<int> width = ParseNumber<int>(text.substr(0, by));
  const std::optional<int> height = ParseNumber<int>(text.substr(std::min(by + 1, text.size())));
  const auto good = [](const std::optional<int>& side) {
    return side && *side >= 1 && *side <= kMaxPixels;
  };
  if (!good(width) || !good(height))
    RefuseValue(name, "WIDTHxHEIGHT, each from 1 to " + std::to_string(kMaxPixels), text);
  picture_options->width = *width;
  picture_options->height = *height;
}

class Parser {
 public:
  Options Parse(int argc, char* argv[]) {
    std::vector<char*> arguments(argv, argv + argc);
    options_.replay = argc > 1 && std::string_view(argv[1]) == "replay";
    if (options_.replay) arguments.erase(arguments.begin() + 1);
    std::vector<CommandOption> all = RunCommandOptions(&options_.run);
    for (const std::vector<CommandOption>& some : {RunningOptions(), OutputOptions(), LogOptions()})
      all.insert(all.end(), some.begin(), some.end());
    CommandLine line = ParseCommandLine(arguments, all, [this] { return IsDone(options_); });
    if (IsDone(options_)) return options_;
    for (const std::string& name : line.given)
      if (name.starts_with("--log-") && options_.log.file.empty())
        throw UsageError(name + " is for --log");
    options_.worldfiles = std::move(line.operands);
    return options_;
  }

  /// True if all other options are ignored.
  static bool IsDone(const Options& options) {
    return options.action == Action::kHelp || options.action == Action::kVersion;
  }

 private:
  // Values of --clock, --gui and --help are accepted and ignored for compatibility.
  std::vector<CommandOption> RunningOptions() {
    return {
        {"args", required_argument, Store(&options_.controller_args), 'a'},
        {"budget-horizon", required_argument,
         [this](Text name, Text value) {
           options_.horizon =
               ParseWithin(name, 1e-6, 86400, "simulated seconds, from 0.000001 to 86400", value);
         }},
        {"budget-ms", required_argument,
         [this](Text name, Text value) {
           Choose(Action::kBudget);
           options_.budget_ms =
               ParseWithin(name, 0.001, 60000, "milliseconds, from 0.001 to 60000", value);
         }},
        {"clock", optional_argument,
         [this](Text, Text) { TurnOn(&options_.run.clock, "[Clock enabled]"); }, 'c'},
        {"explain", optional_argument,
         [this](Text name, Text value) {
           if (!value.empty() && value != "text" && value != "json")
             RefuseValue(name, "nothing, or text, or json", value);
           Choose(Action::kExplain);
           options_.explain_as_json = value == "json";
         }},
        {"explain-ray", required_argument,
         [this](Text, Text value) {
           Choose(Action::kExplainRay);
           options_.explained_ray = value;
         }},
        {"foxglove", optional_argument,
         [this](Text name, Text value) {
           SetLive(name, value, &options_.foxglove_port);
           options_.foxglove = true;
         }},
        {"from-snapshot", required_argument,
         StoreNonEmpty(&options_.first_snapshot, "the name of a file")},
        {"gui", optional_argument,
         [this](Text, Text) { TurnOn(&options_.no_gui, "[GUI disabled]"); }, 'g'},
        {"help", optional_argument, Set(&options_.action, Action::kHelp), 'h'},
        {"live", optional_argument,
         [this](Text name, Text value) { SetLive(name, value, &options_.live_port); }},
        {"version", no_argument, Set(&options_.action, Action::kVersion)},
    };
  }

  std::vector<CommandOption> OutputOptions() {
    return {
        {"no-progress", no_argument, Set(&options_.progress, false)},
        {"progress", no_argument, Set(&options_.progress, true)},
        {"record", required_argument,
         StoreNonEmpty(&options_.pictures.film,
                       "the name of a folder or of a video, such as film.mp4")},
        {"save-snapshot", required_argument,
         [this](Text name, Text value) { options_.snapshot = ParseSnapshotOrder(name, value); }},
        {"screenshot", required_argument,
         [this](Text name, Text value) {
           options_.pictures.shots.push_back(ParseShot(name, value));
         }},
        {"size", required_argument,
         [this](Text name, Text value) { ParseSize(name, value, &options_.pictures); }},
        {"state-hash", no_argument, Set(&options_.state_hash, true)},
        {"stats", required_argument,
         StoreNonEmpty(&options_.stats_file, "the name of a file, or - for standard output")},
    };
  }

  std::vector<CommandOption> LogOptions() {
    std::vector<CommandOption> options = LogCommandOptions([this] { return &options_.log; });
    options.push_back(
        {"log", required_argument, StoreNonEmpty(&options_.log.file, "the name of a file")});
    return options;
  }

  /// The first option that chooses an action counts.
  void Choose(Action action) {
    if (options_.action == Action::kRun) options_.action = action;
  }

  void TurnOn(bool* option, const char* tag) {
    if (!*option) options_.tags += tag;
    *option = true;
  }

  void SetLive(Text name, Text port, std::string* to) {
    const std::optional<int> number = ParseNumber<int>(port);
    if (!port.empty() && !(number && *number >= 0 && *number <= 65535))
      RefuseValue(name, "nothing, or a port, from 0 to 65535", port);
    Choose(Action::kLive);
    *to = port;
  }

  Options options_;
};

bool LoadsWorlds(const Options& options) {
  return options.action == Action::kRun || options.action == Action::kExplain ||
         options.action == Action::kBudget || options.action == Action::kLive;
}

/// Throws UsageError, naming the option, if there are several worlds.
void RequireOneWorld(const Options& options, const std::string& name) {
  if (options.worldfiles.size() > 1)
    throw UsageError(name + ": found " + std::to_string(options.worldfiles.size()) +
                     " world files, expected one");
}

/// STAGE_CL_DEVICE selects the device if the command line does not. The name "list" lists all.
void ResolveDevice(Options* options) {
  RunOptions& run = options->run;
  const char* const choice = std::getenv("STAGE_CL_DEVICE");
  if (run.opencl && run.device.empty() && choice) run.device = choice;
  if (run.device == "list") options->action = Action::kListDevices;
}

/// Checks and completes snapshot options: they need a single world and no window.
void ResolveSnapshotOptions(Options* options) {
  if (options->first_snapshot.empty() && !options->snapshot) return;
  RequireOneWorld(*options, options->snapshot ? "--save-snapshot" : "--from-snapshot");
  if (!options->snapshot) return;
  options->no_gui = true;
  const usec_t duration = options->run.duration;
  if (duration > 0 && options->snapshot->time > duration)
    RefuseValue("--save-snapshot", "a time within the --duration",
                options->snapshot->file + "@" +
                    std::to_string(static_cast<double>(options->snapshot->time) / 1e6));
}

/// Checks and completes image options: they need a single world and no window.
void ResolvePictureOptions(Options* options) {
  offscreen::PictureOptions& picture_options = options->pictures;
  if (picture_options.shots.empty() && picture_options.film.empty()) {
    if (picture_options.width > 0) throw UsageError("--size is for --screenshot and --record");
    return;
  }
  options->no_gui = true;
  if (options->worldfiles.size() > 1)
    throw UsageError("found " + std::to_string(options->worldfiles.size()) +
                     " world files, expected one: pictures are made of a single world");
  const usec_t duration = options->run.duration;
  for (offscreen::PictureOptions::Shot& shot : picture_options.shots) {
    if (shot.time == kAtTheEnd) shot.time = duration > 0 ? duration : kShotTime;
    if (duration > 0 && shot.time > duration)
      RefuseValue("--screenshot", "a time within the --duration",
                  shot.file + "@" + std::to_string(static_cast<double>(shot.time) / 1e6));
  }
  if (duration > 0 || !picture_options.film.empty()) return;
  for (const offscreen::PictureOptions::Shot& shot : picture_options.shots)
    options->run.duration = std::max(options->run.duration, shot.time);
}

bool IsWorld(const std::string& file, const std::vector<std::string>& worldfiles) {
  std::error_code ignored;
  return file.ends_with(".world") ||
         std::any_of(worldfiles.begin(), worldfiles.end(), [&](const std::string& world) {
           return world == file || std::filesystem::equivalent(world, file, ignored);
         });
}

/// Each output needs its own file. A world file is refused as output too, because it is probably
/// the world after an option whose FILE was forgotten.
void CheckOutputs(const Options& options) {
  std::vector<std::pair<const char*, std::string>> outputs;
  if (!options.stats_file.empty() && options.stats_file != "-")
    outputs.emplace_back("--stats", options.stats_file);
  if (!options.log.file.empty()) outputs.emplace_back("--log", options.log.file);
  if (!options.pictures.film.empty()) outputs.emplace_back("--record", options.pictures.film);
  for (const offscreen::PictureOptions::Shot& shot : options.pictures.shots)
    outputs.emplace_back("--screenshot", shot.file);
  std::set<std::string> places;
  for (const auto& [option, name] : outputs) {
    if (IsWorld(name, options.worldfiles))
      RefuseValue(option, "the name of an output file, not a world file", name);
    if (!places.insert(files::AbsolutePath(name)).second)
      RefuseValue(option, "a name that no other output has", name);
  }
}

/// A replay needs exactly one log and excludes options of a run.
void CheckReplay(const Options& options) {
  if (!options.replay) return;
  if (options.worldfiles.size() != 1)
    throw UsageError("replay: found " + std::to_string(options.worldfiles.size()) +
                     " files, expected one: a log that --log has written");
  if (options.action != Action::kRun || !options.log.file.empty() ||
      !options.first_snapshot.empty() || options.snapshot)
    throw UsageError("replay: found an option of runs; replay accepts only output options");
}

/// Runs need worlds; other actions do not.
void CheckWorlds(const Options& options) {
  if (LoadsWorlds(options) && options.worldfiles.empty())
    throw UsageError("found no world file, expected at least one, such as worlds/simple.world");
}

}  // namespace

Options ParseOptions(int argc, char* argv[]) {
  Options options = Parser().Parse(argc, argv);
  if (Parser::IsDone(options)) return options;
  ResolveDevice(&options);
  CheckOutputs(options);
  CheckReplay(options);
  CheckWorlds(options);
  if (!options.log.file.empty()) RequireOneWorld(options, "--log");
  if (options.action == Action::kBudget) RequireOneWorld(options, "--budget-ms");
  if (options.action == Action::kLive)
    RequireOneWorld(options, options.foxglove ? "--foxglove" : "--live");
  ResolveSnapshotOptions(&options);
  ResolvePictureOptions(&options);
  return options;
}

}  // namespace Stg::program
