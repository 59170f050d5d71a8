// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/options.hh"

#include <getopt.h>

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
#include "stage/option_values.hh"
#include "stage/parse_number.hh"

namespace Stg::program {

namespace {

// Options without a short form have values above all characters.
enum Id : int {
  kArgs = 'a',
  kClock = 'c',
  kGui = 'g',
  kHelp = 'h',
  kQuestion = '?',
  kVersion = kFirstLongOption,
  kDuration,
  kSeed,
  kThreads,
  kRayModel,
  kStats,
  kStateHash,
  kOpencl,
  kOpenclAlways,
  kNoBatch,
  kNoControllers,
  kProgress,
  kNoProgress,
  kExplain,
  kExplainRay,
  kScreenshot,
  kRecord,
  kSize,
  kLog,
  kLogEvery,
  kLogModels,
  kLogCompression,
  kLogRanges,
  kFromSnapshot,
  kSaveSnapshot,
  kBudget,
  kHorizon,
  kSet,
  kLive,
  kFoxglove
};

// The leading colon makes getopt silent; it then tells a missing value from an unknown option.
constexpr char kShortOptions[] = ":a:cgh";

// Values of --clock, --gui and --help are accepted and ignored for compatibility.
constexpr option kLongOptions[] = {
    {"args", required_argument, nullptr, kArgs},
    {"budget-horizon", required_argument, nullptr, kHorizon},
    {"budget-ms", required_argument, nullptr, kBudget},
    {"clock", optional_argument, nullptr, kClock},
    {"duration", required_argument, nullptr, kDuration},
    {"explain", optional_argument, nullptr, kExplain},
    {"explain-ray", required_argument, nullptr, kExplainRay},
    {"foxglove", optional_argument, nullptr, kFoxglove},
    {"from-snapshot", required_argument, nullptr, kFromSnapshot},
    {"gui", optional_argument, nullptr, kGui},
    {"help", optional_argument, nullptr, kHelp},
    {"live", optional_argument, nullptr, kLive},
    {"log", required_argument, nullptr, kLog},
    {"log-compression", required_argument, nullptr, kLogCompression},
    {"log-every", required_argument, nullptr, kLogEvery},
    {"log-models", required_argument, nullptr, kLogModels},
    {"log-ranges", required_argument, nullptr, kLogRanges},
    {"no-batch", no_argument, nullptr, kNoBatch},
    {"no-controllers", no_argument, nullptr, kNoControllers},
    {"no-progress", no_argument, nullptr, kNoProgress},
    {"opencl", optional_argument, nullptr, kOpencl},
    {"opencl-always", no_argument, nullptr, kOpenclAlways},
    {"progress", no_argument, nullptr, kProgress},
    {"ray-model", required_argument, nullptr, kRayModel},
    {"record", required_argument, nullptr, kRecord},
    {"save-snapshot", required_argument, nullptr, kSaveSnapshot},
    {"screenshot", required_argument, nullptr, kScreenshot},
    {"seed", required_argument, nullptr, kSeed},
    {"set", required_argument, nullptr, kSet},
    {"size", required_argument, nullptr, kSize},
    {"state-hash", no_argument, nullptr, kStateHash},
    {"stats", required_argument, nullptr, kStats},
    {"threads", required_argument, nullptr, kThreads},
    {"version", no_argument, nullptr, kVersion},
    {nullptr, 0, nullptr, 0},
};

constexpr int kMaxPixels = 16384;  // maximum side of an image
constexpr usec_t kAtTheEnd = std::numeric_limits<usec_t>::max();
constexpr usec_t kShotTime = 1000000;  // for runs without an end

std::string NameOf(int id) {
  for (const option* o = kLongOptions; o->name; o++)
    if (o->val == id) return std::string("--") + o->name;
  return "";
}

[[noreturn]] void Refuse(int id, const std::string& expected, const std::string& found) {
  RefuseValue(NameOf(id), expected, found);
}

/// Parses FILE@SECONDS.
Options::SnapshotOrder ParseSnapshotOrder(const std::string& text) {
  const size_t at = text.rfind('@');
  const std::optional<double> seconds =
      at == std::string::npos ? std::nullopt : ParseNumber<double>(text.substr(at + 1));
  if (at == 0 || !seconds || !(*seconds >= 0 && *seconds <= kMaxDuration))
    Refuse(kSaveSnapshot, "FILE@SECONDS, as cave.snapshot@60", text);
  return {text.substr(0, at), static_cast<usec_t>(std::llround(*seconds * 1e6))};
}

/// Parses FILE.png or FILE.png@SECONDS; names may contain an @.
offscreen::PictureOptions::Shot ParseShot(const std::string& text) {
  offscreen::PictureOptions::Shot shot{text, kAtTheEnd};
  const size_t at = text.rfind('@');
  const std::optional<double> seconds =
      at == std::string::npos ? std::nullopt : ParseNumber<double>(text.substr(at + 1));
  if (seconds) {
    if (!(*seconds >= 0 && *seconds <= kMaxDuration))
      Refuse(kScreenshot, "simulated seconds after the @, from 0 to 1e12", text);
    shot.file = text.substr(0, at);
    shot.time = static_cast<usec_t>(std::llround(*seconds * 1e6));
  }
  if (shot.file.size() < 5 || !shot.file.ends_with(".png"))
    Refuse(kScreenshot, "FILE.png or FILE.png@SECONDS", text);
  return shot;
}

void ParseSize(const std::string& text, offscreen::PictureOptions* picture_options) {
  const size_t by = std::min(text.find('x'), text.size());
  const std::optional<int> width = ParseNumber<int>(text.substr(0, by));
  const std::optional<int> height = ParseNumber<int>(text.substr(std::min(by + 1, text.size())));
  const auto good = [](const std::optional<int>& side) {
    return side && *side >= 1 && *side <= kMaxPixels;
  };
  if (!good(width) || !good(height))
    Refuse(kSize, "WIDTHxHEIGHT, each from 1 to " + std::to_string(kMaxPixels), text);
  picture_options->width = *width;
  picture_options->height = *height;
}

class Parser {
 public:
  Parser(int argc, char* argv[]) : arguments_(argv, argv + argc) {
    options_.replay = argc > 1 && std::string_view(argv[1]) == "replay";
    if (options_.replay) arguments_.erase(arguments_.begin() + 1);
    arguments_.push_back(nullptr);
  }

  Options Parse() {
    const int count = static_cast<int>(arguments_.size()) - 1;
    int id;
    while ((id = getopt_long(count, arguments_.data(), kShortOptions, kLongOptions, nullptr)) !=
           -1) {
      Apply(id);
      if (options_.action == Options::Action::kHelp || options_.action == Options::Action::kVersion)
        return options_;
    }
    for (int i = optind; i < count; i++)
      options_.worldfiles.push_back(arguments_[static_cast<size_t>(i)]);
    if (log_option_ != 0 && options_.log.file.empty())
      throw UsageError(NameOf(log_option_) + " is for --log");
    return options_;
  }

 private:
  void Apply(int id) {
    const std::string value = optarg ? optarg : "";
    switch (id) {
      case kArgs:
        options_.controller_args = value;
        break;
      case kClock:
        TurnOn(&options_.run.clock, "[Clock enabled]");
        break;
      case kGui:
        TurnOn(&options_.no_gui, "[GUI disabled]");
        break;
      case kHelp:
        options_.action = Options::Action::kHelp;
        break;
      case kVersion:
        options_.action = Options::Action::kVersion;
        break;
      case kDuration:
        options_.run.duration = ParseDuration(NameOf(id), value);
        break;
      case kSeed:
        options_.run.seed = ParseSeed(NameOf(id), value);
        break;
      case kThreads:
        options_.run.threads = ParseThreads(NameOf(id), value);
        break;
      case kRayModel:
        options_.run.ray_model = ParseRayModel(NameOf(id), value);
        break;
      case kStats:
        SetStatsFile(value);
        break;
      case kStateHash:
        options_.state_hash = true;
        break;
      case kOpencl:
        SetDevice(value);
        break;
      case kOpenclAlways:
        options_.run.opencl = options_.run.always_on_device = true;
        break;
      case kNoBatch:
        options_.run.batch = false;
        break;
      case kNoControllers:
        options_.run.controllers = false;
        break;
      case kProgress:
        options_.progress = true;
        break;
      case kNoProgress:
        options_.progress = false;
        break;
      case kExplain:
        SetExplain(value);
        break;
      case kExplainRay:
        SetExplainRay(value);
        break;
      case kScreenshot:
        options_.pictures.shots.push_back(ParseShot(value));
        break;
      case kRecord:
        if (value.empty())
          Refuse(kRecord, "the name of a folder or of a video, such as film.mp4", value);
        options_.pictures.film = value;
        break;
      case kLog:
        if (value.empty()) Refuse(kLog, "the name of a file", value);
        options_.log.file = value;
        break;
      case kLogEvery:
        options_.log.every = ParseDuration(NameOf(id), value);
        log_option_ = id;
        break;
      case kLogModels:
        options_.log.robots = ParseNames(NameOf(id), value);
        log_option_ = id;
        break;
      case kLogRanges:
        options_.log.ranges = ParseRanges(NameOf(id), value);
        log_option_ = id;
        break;
      case kLogCompression:
        options_.log.compression = ParseCompression(NameOf(id), value);
        log_option_ = id;
        break;
      case kFromSnapshot:
        if (value.empty()) Refuse(kFromSnapshot, "the name of a file", value);
        options_.first_snapshot = value;
        break;
      case kSaveSnapshot:
        options_.snapshot = ParseSnapshotOrder(value);
        break;
      case kBudget:
        if (options_.action == Options::Action::kRun) options_.action = Options::Action::kBudget;
        options_.budget_ms =
            ParseWithin(NameOf(id), 0.001, 60000, "milliseconds, from 0.001 to 60000", value);
        break;
      case kHorizon:
        options_.horizon = ParseWithin(NameOf(id), 1e-6, 86400,
                                       "simulated seconds, from 0.000001 to 86400", value);
        break;
      case kSet:
        options_.run.settings.push_back(value);
        break;
      case kLive:
      case kFoxglove:
        SetLive(id, value);
        break;
      case kSize:
        ParseSize(value, &options_.pictures);
        break;
      default:
        Fail(id);
    }
  }

  void TurnOn(bool* option, const char* tag) {
    if (!*option) options_.tags += tag;
    *option = true;
  }

  void SetStatsFile(const std::string& value) {
    if (value.empty()) Refuse(kStats, "the name of a file, or - for standard output", value);
    options_.stats_file = value;
  }

  void SetExplain(const std::string& value) {
    if (!value.empty() && value != "text" && value != "json")
      Refuse(kExplain, "nothing, or text, or json", value);
    if (options_.action == Options::Action::kRun) options_.action = Options::Action::kExplain;
    options_.explain_as_json = value == "json";
  }

  void SetExplainRay(const std::string& value) {
    if (options_.action == Options::Action::kRun) options_.action = Options::Action::kExplainRay;
    options_.explained_ray = value;
  }

  void SetLive(int id, const std::string& port) {
    const std::optional<int> number = ParseNumber<int>(port);
    if (!port.empty() && !(number && *number >= 0 && *number <= 65535))
      Refuse(id, "nothing, or a port, from 0 to 65535", port);
    if (options_.action == Options::Action::kRun) options_.action = Options::Action::kLive;
    if (id == kFoxglove) options_.foxglove = true;
    (id == kLive ? options_.live_port : options_.foxglove_port) = port;
  }

  void SetDevice(const std::string& value) {
    options_.run.opencl = true;
    options_.run.device = value;
    if (value == "list") options_.action = Options::Action::kListDevices;
  }

  void Fail(int id) {
    // '?' is not among getopt's options, because getopt also returns it for any mistake.
    if (id == kQuestion && optopt == '?') {
      options_.action = Options::Action::kHelp;
      return;
    }
    RefuseOption(id, kLongOptions, arguments_[static_cast<size_t>(optind - 1)]);
  }

  std::vector<char*> arguments_;  // a copy, because getopt reorders it
  Options options_;
  int log_option_ = 0;  // an option given that requires --log
};

bool LoadsWorlds(const Options& options) {
  return options.action == Options::Action::kRun || options.action == Options::Action::kExplain ||
         options.action == Options::Action::kBudget || options.action == Options::Action::kLive;
}

/// Throws UsageError, naming the option, if there are several worlds.
void RequireOneWorld(const Options& options, const std::string& name) {
  if (options.worldfiles.size() > 1)
    throw UsageError(name + ": found " + std::to_string(options.worldfiles.size()) +
                     " world files, expected one");
}

/// STAGE_CL_DEVICE selects the device if the command line does not.
void ReadDeviceFromEnvironment(Options* options) {
  const char* choice = std::getenv("STAGE_CL_DEVICE");
  if (!options->run.opencl || !options->run.device.empty() || !choice) return;
  options->run.device = choice;
  if (options->run.device == "list" && LoadsWorlds(*options))
    options->action = Options::Action::kListDevices;
}

/// Checks and completes snapshot options: they need a single world and no window.
void ResolveSnapshotOptions(Options* options) {
  if (options->first_snapshot.empty() && !options->snapshot) return;
  RequireOneWorld(*options, NameOf(options->snapshot ? kSaveSnapshot : kFromSnapshot));
  if (!options->snapshot) return;
  options->no_gui = true;
  const usec_t duration = options->run.duration;
  if (duration > 0 && options->snapshot->time > duration)
    Refuse(kSaveSnapshot, "a time within the --duration",
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
      Refuse(kScreenshot, "a time within the --duration",
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
  std::vector<std::pair<int, std::string>> outputs;
  if (!options.stats_file.empty() && options.stats_file != "-")
    outputs.emplace_back(kStats, options.stats_file);
  if (!options.log.file.empty()) outputs.emplace_back(kLog, options.log.file);
  if (!options.pictures.film.empty()) outputs.emplace_back(kRecord, options.pictures.film);
  for (const offscreen::PictureOptions::Shot& shot : options.pictures.shots)
    outputs.emplace_back(kScreenshot, shot.file);
  std::set<std::string> places;
  for (const auto& [id, name] : outputs) {
    if (IsWorld(name, options.worldfiles))
      Refuse(id, "the name of an output file, not a world file", name);
    if (!places.insert(files::AbsolutePath(name)).second)
      Refuse(id, "a name that no other output has", name);
  }
}

/// A replay needs exactly one log and excludes options of a run.
void CheckReplay(const Options& options) {
  if (!options.replay) return;
  if (options.worldfiles.size() != 1)
    throw UsageError("replay: found " + std::to_string(options.worldfiles.size()) +
                     " files, expected one: a log that --log has written");
  if (options.action != Options::Action::kRun || !options.log.file.empty() ||
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
  Options options = Parser(argc, argv).Parse();
  ReadDeviceFromEnvironment(&options);
  if (options.action == Options::Action::kHelp || options.action == Options::Action::kVersion)
    return options;
  CheckOutputs(options);
  CheckReplay(options);
  CheckWorlds(options);
  if (!options.log.file.empty()) RequireOneWorld(options, NameOf(kLog));
  if (options.action == Options::Action::kBudget) RequireOneWorld(options, NameOf(kBudget));
  if (options.action == Options::Action::kLive)
    RequireOneWorld(options, NameOf(options.foxglove ? kFoxglove : kLive));
  ResolveSnapshotOptions(&options);
  ResolvePictureOptions(&options);
  return options;
}

}  // namespace Stg::program
