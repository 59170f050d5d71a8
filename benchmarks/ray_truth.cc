// SPDX-License-Identifier: GPL-2.0-or-later
//
// ray_truth: compares the readings of a world's range sensors with exact geometry.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "benchmarks/truth/command_line.hh"
#include "benchmarks/truth/comparison.hh"
#include "benchmarks/truth/summary.hh"

namespace {

const char kHelp[] =
    R"(Usage: ray_truth [OPTION]... WORLDFILE

Runs a world and compares every reading of every range sensor with exact geometry: the nearest
crossing of the ray with the outline of a body that stops it, worked out in extended precision and
without the simulator's grid. Prints how many hits were lost or made up, and percentiles of the
error in metres, for all readings and for groups of them:
  near       what is less than 2 m away
  range      by the true distance
  incidence  by the angle between the ray and what it hits: 90 degrees head-on, 0 along it
  object     what is hit: a wall (anything that does not drive) or a robot
  start      by the distance from the sensor to the nearest outline, in cells of the grid
  age        by the time since the sensor looked

Which readings
  --seconds S      simulated time to run (default 1)
  --from S         compare from that simulated time on (default 0)
  --every N        compare every Nth step (default 1)
  --still          robots stay where they are; only the first reading of each sensor counts
  --held           compare what each sensor holds in a step, be it old, with what it would see now
                   (otherwise: readings of that step only)
  --between N      compare at N bearings spread evenly over each sensor's field of view; the reading
                   there is interpolated between the two neighbouring beams, and no hit counts as
                   the maximum range

How it runs
  --seed N         of all random numbers (default 1)
  --threads N      that trace rays (default 1)

What comes out
  --json FILE      the summary as JSON
  --csv FILE       one line for each reading
  --quiet          no summary on standard output
  --help           print this and end

Errors are taken where the ray and the truth both hit something; a hit that only one of them has is
counted as missed or false. Sensors with noise are left out, and their readings counted. Controllers
run as in any world; all sensors are made to work, whether a controller uses them or not.

Example
  ray_truth --still worlds/cave.world

Exit status: 0, or 1 if the world can't be loaded or nothing was compared, or 2 for wrong options.
)";

struct Options : truth::CommonOptions {
  double seconds = 1, from = 0;
  unsigned every = 1;
  bool quiet = false;
  std::string json, csv;
  truth::ComparisonOptions comparison;
};

enum Id : int {
  kSeconds = truth::kOwn,
  kFrom,
  kEvery,
  kStill,
  kHeld,
  kBetween,
  kJson,
  kCsv,
  kQuiet
};

constexpr option kLongOptions[] = {{"seconds", required_argument, nullptr, kSeconds},
                                   {"from", required_argument, nullptr, kFrom},
                                   {"every", required_argument, nullptr, kEvery},
                                   {"still", no_argument, nullptr, kStill},
                                   {"held", no_argument, nullptr, kHeld},
                                   {"between", required_argument, nullptr, kBetween},
                                   {"seed", required_argument, nullptr, truth::kSeed},
                                   {"threads", required_argument, nullptr, truth::kThreads},
                                   {"json", required_argument, nullptr, kJson},
                                   {"csv", required_argument, nullptr, kCsv},
                                   {"quiet", no_argument, nullptr, kQuiet},
                                   {"help", no_argument, nullptr, truth::kHelpWanted},
                                   {nullptr, 0, nullptr, 0}};

using truth::Number;
using truth::UsageError;
using truth::WholeNumber;
using Mode = truth::ComparisonOptions::Mode;

void SetMode(Options* options, Mode mode) {
  if (options->comparison.mode != Mode::kFresh && options->comparison.mode != mode)
    throw UsageError("--held and --between exclude each other");
  options->comparison.mode = mode;
}

void Apply(int id, const std::string& value, Options* options) {
  switch (id) {
    case kSeconds:
      options->seconds = Number("--seconds", value, 1e-6, 1e9);
      break;
    case kFrom:
      options->from = Number("--from", value, 0, 1e9);
      break;
    case kEvery:
      options->every = static_cast<unsigned>(WholeNumber("--every", value, 1, 1e9));
      break;
    case kStill:
      options->comparison.once = true;
      break;
    case kHeld:
      SetMode(options, Mode::kHeld);
      break;
    case kBetween:
      SetMode(options, Mode::kBetween);
      options->comparison.bearings = static_cast<unsigned>(WholeNumber("--between", value, 2, 1e7));
      break;
    case kJson:
      options->json = value;
      break;
    case kCsv:
      options->csv = value;
      break;
    case kQuiet:
      options->quiet = true;
      break;
  }
}

Options ReadOptions(int argc, char* argv[]) {
  Options options;
  truth::ReadCommandLine(argc, argv, kHelp, kLongOptions, &options,
                         [&](int id, const std::string& value) { Apply(id, value, &options); });
  return options;
}

int HoldStill(Stg::Model* model, void*) {
  model->Disable();
  return 0;
}

/// A file that is written during the run.
class CsvFile {
 public:
  explicit CsvFile(const std::string& path) {
    if (path.empty()) return;
    out_.open(path);
    if (!out_) throw std::runtime_error("can't write the readings to '" + path + "'");
    out_ << truth::CsvHeader() << '\n';
  }
  void Add(const truth::Reading& reading) {
    if (out_.is_open()) out_ << truth::CsvLine(reading) << '\n';
  }
  void Close() {
    if (!out_.is_open()) return;
    out_.close();
    if (out_.fail()) throw std::runtime_error("the file of the readings can't be written");
  }

 private:
  std::ofstream out_;
};

struct Outcome {
  uint64_t steps = 0, compared_steps = 0, noisy_readings = 0;
};

Outcome Run(const Options& options, Stg::World* world, truth::Summary* summary) {
  CsvFile csv(options.csv);
  truth::Comparison comparison(world, options.comparison, [&](const truth::Reading& reading) {
    summary->Add(reading);
    csv.Add(reading);
  });
  if (options.comparison.once) world->ForEachDescendant(HoldStill, nullptr);
  world->SetQuitTime(static_cast<Stg::usec_t>(std::llround(options.seconds * 1e6)));

  Outcome outcome;
  const auto from = static_cast<Stg::usec_t>(std::llround(options.from * 1e6));
  while (true) {
    const bool compare = world->SimTimeNow() + world->sim_interval >= from &&
                         (outcome.steps + 1) % options.every == 0;
    if (comparison.Step(compare)) break;
    outcome.steps++;
    outcome.compared_steps += compare;
    if (options.comparison.once && comparison.HasReportedAll()) break;
  }
  outcome.noisy_readings = comparison.noisy_readings();
  csv.Close();
  return outcome;
}

using Json = nlohmann::ordered_json;

Json Describe(const Options& options, const Stg::World& world, const Outcome& outcome,
              truth::Summary* summary) {
  char hash[32];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(world.StateHash()));
  constexpr const char* kModes[] = {"fresh", "held", "between"};
  Json json = {{"program", "ray_truth"},
               {"worldfile", options.world},
               {"mode", kModes[static_cast<int>(options.comparison.mode)]},
               {"still", options.comparison.once},
               {"seed", options.seed},
               {"cell", 1 / world.Resolution()},
               {"simulated_seconds", static_cast<double>(world.SimTimeNow()) / 1e6},
               {"steps", outcome.steps},
               {"compared_steps", outcome.compared_steps},
               {"noisy_readings", outcome.noisy_readings},
               {"state_hash", hash}};
  json["groups"] = Json::array();
  for (truth::Summary::Bin& bin : summary->bins()) {
    Json entry = {{"group", bin.group}, {"bin", bin.bin}};
    for (const auto& [name, value] : bin.tally.Figures()) entry[name] = value;
    json["groups"].push_back(entry);
  }
  return json;
}

void Print(const Json& json) {
  // The simulator's messages end without a newline.
  std::printf("\n%-10s %-32s %9s %7s %7s %7s %10s %10s %10s %10s\n", "group", "", "readings",
              "missed", "false", "wrong", "p50 m", "p95 m", "p99 m", "max m");
  for (const Json& bin : json["groups"]) {
    std::printf("%-10s %-32s", bin["group"].get<std::string>().c_str(),
                bin["bin"].get<std::string>().c_str());
    std::printf(" %9.0f", bin["readings"].get<double>());
    for (const char* name : {"missed", "false", "wrong_object"})
      std::printf(" %7.0f", bin[name].get<double>());
    for (const char* name : {"p50", "p95", "p99", "max"})
      std::printf(" %10.3g", bin[name].get<double>());
    std::printf("\n");
  }
}

void WriteJson(const std::string& path, const Json& json) {
  std::ofstream out(path);
  out << json.dump(2) << '\n';
  out.close();
  if (out.fail()) throw std::runtime_error("can't write the summary to '" + path + "'");
}

int Main(int argc, char* argv[]) {
  const Options options = ReadOptions(argc, argv);
  Stg::World* world = truth::LoadWorld(argc, argv, options);
  if (!world) return 1;

  truth::Summary summary(1 / world->Resolution());
  const Outcome outcome = Run(options, world, &summary);
  const Json json = Describe(options, *world, outcome, &summary);
  if (!options.json.empty()) WriteJson(options.json, json);
  if (!options.quiet) Print(json);
  if (outcome.noisy_readings > 0)
    std::fprintf(stderr, "ray_truth: %llu readings have noise and were left out\n",
                 static_cast<unsigned long long>(outcome.noisy_readings));
  if (!json["groups"].empty()) return 0;
  std::fprintf(stderr,
               "ray_truth: no reading was compared: the world has no range sensor that "
               "works without noise in that time\n");
  return 1;
}

}  // namespace

int main(int argc, char* argv[]) {
  return truth::RunProgram("ray_truth", [&] { return Main(argc, argv); });
}
