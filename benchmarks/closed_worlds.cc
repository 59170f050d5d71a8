// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps of many small closed worlds as rows, and as worlds for comparison.
//
//   closed_worlds SCENE WORLDS ROBOTS RAYS REACH CONTACTS RAY_MODEL THREADS SECONDS
//                 [--ctrl=TEXT [--objects]] [--device[=CHOICE] [--work-items=N] [--steps=K]]
//
// SCENE is open, walled, cave or hospital; CONTACTS cells or outlines; RAY_MODEL cell or exact.
// Prints steps of robots in a second, bytes of a world, and microseconds to make and to reset one.
// Fails if no ray hits anything, no robot moves, or a row has another state than the world with its
// commands. On the host, steps are made one at a time, so that all rays of each step are cast.
//
// With --ctrl, the robots have that controller and get no other commands. With --objects, World
// objects are stepped instead of rows.
//
// With --device, the worlds are stepped on an OpenCL device, too, N work-items for each (default:
// the device's choice). First, each launch makes K steps (default 1); only its last step casts
// rays, unless a controller or noise needs them. Then commands are sent and readings fetched for
// each step. Fails if a bit of any column differs from the host's.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "rows/device_columns.hh"
#include "rows/device_rows.hh"
#include "rows/row_bridge.hh"
#include "stage.hh"
#include "threads/wall_clock.hh"
#include "threads/worker_pool.hh"

namespace {

using Stg::threads::WallClock;

struct Arguments {
  std::string scene, contacts, ray_model;
  size_t worlds, robots, rays;
  double reach;
  unsigned threads;
  double seconds;
  std::string ctrl = "";
  bool objects = false;
  std::string device = "";  // the option as given; empty: none
  uint32_t work_items = 0, steps_of_launch = 1;
};

struct Place {
  double x, y;
};

/// Free places of the cave and of the hospital.
constexpr Place kCavePlaces[] = {{-0.47, -6.6}, {-2, -5},      {-3.1, -8.9}, {0.36, 0.33},
                                 {-1.9, 3.7},   {2.06, 11.85}, {-8.4, 9.4},  {-3.6, 9.75}};
constexpr Place kHospitalPlaces[] = {
    {101.1, 79.7}, {140.7, 0.9},   {181.7, 88.4},   {-222.8, -59.4},
    {265.8, 59.7}, {161.1, 103.7}, {-128.9, 62.2},  {125.6, 14.1},
    {213.1, 61.8}, {49.1, -75.1},  {-36.5, -107.7}, {-146.4, -50.3},
    {20.8, -73.6}, {184.8, -84.4}, {-0.6, 101.5},   {-163.2, 71.4}};

/// One robot at each place of a map, further ones beside them.
Place PlaceIn(std::span<const Place> places, size_t i) {
  const size_t again = i / places.size();
  const Place& place = places[i % places.size()];
  return {place.x + 0.3 * static_cast<double>(again % 2),
          place.y + 0.3 * static_cast<double>(again / 2)};
}

/// Places in a square of 2 m.
Place PlaceInSquare(size_t robots, size_t i) {
  const auto side = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(robots))));
  const auto at = [&](size_t k) {
    return 2.0 * (static_cast<double>(k) + 0.5) / static_cast<double>(side) - 1;
  };
  return {at(i % side), at(i / side)};
}

Place PlaceOf(const Arguments& a, size_t i) {
  if (a.scene == "cave") return PlaceIn(kCavePlaces, i);
  if (a.scene == "hospital") return PlaceIn(kHospitalPlaces, i);
  return PlaceInSquare(a.robots, i);
}

/// Octagonal robots of 0.2 m in a square, without or with walls, or in a map.
std::string WorldText(const Arguments& a) {
  std::ostringstream text;
  text << "resolution " << (a.scene == "hospital" ? 0.1 : 0.02) << "\ncontacts \"" << a.contacts
       << "\"\nray_model \"" << a.ray_model << "\"\n";
  const auto box = [&](double x, double y, double dx, double dy) {
    text << "model( pose [" << x << " " << y << " 0 0] size [" << dx << " " << dy << " 1] )\n";
  };
  if (a.scene == "walled") {
    for (const double side : {-1.21, 1.21}) {
      box(0, side, 2.5, 0.05);
      box(side, 0, 0.05, 2.5);
    }
  }
  if (a.scene == "cave")
    text << "model( bitmap \"" STAGE_SOURCE_WORLDS "/bitmaps/cave.png\" size [32 32 0.5] )\n";
  if (a.scene == "hospital")
    text << "model( bitmap \"" STAGE_SOURCE_WORLDS "/bitmaps/hospital.png\" size [540 220 0.5] )\n";
  text << "define robot position( drive \"omni\" size [0.2 0.2 0.2] block( points 8";
  for (int i = 0; i < 8; i++) {
    const double angle = (i + 0.5) * M_PI / 4;
    text << " point[" << i << "] [" << std::cos(angle) << " " << std::sin(angle) << "]";
  }
  text << " z [0 1] )";
  if (!a.ctrl.empty()) text << " ctrl \"" << a.ctrl << "\"";
  text << " ranger( pose [0 0 -0.1 0] sensor( range [0 " << a.reach << "] fov 330 samples "
       << a.rays << " ) ) )\n";
  for (size_t i = 0; i < a.robots; i++) {
    const Place at = PlaceOf(a, i);
    text << "robot( pose [" << at.x << " " << at.y << " 0 " << 37 * i << "] )\n";
  }
  return text.str();
}

std::unique_ptr<Stg::World> Load(const std::string& text, uint64_t seed) {
  Stg::RunOptions options;
  options.seed = seed;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content(text);
  if (!world->Load(content, "many.world")) std::exit(1);
  for (Stg::Model* robot : world->GetChildren())
    if (dynamic_cast<Stg::ModelPosition*>(robot)) {
      robot->Subscribe();
      for (Stg::Model* sensor : robot->GetChildren()) sensor->Subscribe();
    }
  return world;
}

/// The command of a robot in a step: a mean that changes every 20 steps, and a deviation.
Stg::rows::Planar Command(uint64_t robot, uint64_t step) {
  const auto number = [&](uint64_t salt, uint64_t time) {
    return static_cast<double>(Stg::MixSeeds(robot * 3 + salt, time) >> 11) * 0x1p-52 - 1;
  };
  const auto axis = [&](uint64_t salt) {
    return 0.7 * number(salt, step / 20) + 0.3 * number(salt + 7, step);
  };
  return {axis(0), axis(1), axis(2)};
}

void Fail(const char* what) {
  std::fprintf(stderr, "closed_worlds: %s\n", what);
  std::exit(1);
}

/// Compares the first worlds with rows that got the same commands.
void Compare(const Arguments& a, const std::string& text,
             const std::shared_ptr<const Stg::rows::Scene>& scene) {
  const std::vector<uint64_t> seeds = {3, 4};
  Stg::rows::Rows rows(scene, seeds);
  const auto scratch = rows.MakeScratch();
  const size_t robots = scene->movers.size();
  const std::unique_ptr<Stg::World> written = Load(text, 1);
  for (size_t i = 0; i < seeds.size(); i++) {
    const std::unique_ptr<Stg::World> world = Load(text, seeds[i]);
    for (uint64_t step = 0; step < 100; step++) {
      for (size_t k = 0; a.ctrl.empty() && k < robots; k++) {
        const Stg::rows::Planar command = Command(i * robots + k, step);
        rows.columns.command[i * robots + k] = command;
        auto* const model =
            static_cast<Stg::ModelPosition*>(world->FindModel(scene->movers[k].model->GetId()));
        model->SetSpeed(command.x, command.y, command.a);
      }
      world->Update();
      rows.Step(i, 1, scratch.get());
    }
    if (!Stg::RowBridge::Write(rows, i, written.get()) ||
        written->StateHash() != world->StateHash())
      Fail("a row and a world have different states");
  }
}

/// Commands of all robots at some moments, which repeat.
class Commands {
 public:
  static constexpr uint64_t kMoments = 64;
  explicit Commands(size_t robots) : robots_(robots), commands_(kMoments * robots) {
    for (uint64_t moment = 0; moment < kMoments; moment++)
      for (size_t i = 0; i < robots; i++) commands_[moment * robots + i] = Command(i, moment);
  }
  /// The commands of a step, in the order of the robots of all worlds.
  const Stg::rows::Planar* At(uint64_t step) const { return &commands_[step % kMoments * robots_]; }

 private:
  size_t robots_;
  std::vector<Stg::rows::Planar> commands_;
};

/// The worlds on the host, and its threads.
struct Host {
  Host(const Arguments& arguments, const std::shared_ptr<const Stg::rows::Scene>& scene,
       const std::vector<uint64_t>& seeds)
      : a(arguments), rows(scene, seeds), pool(a.threads), commands(a.worlds * a.robots) {
    for (unsigned i = 0; i < a.threads; i++) scratches.push_back(rows.MakeScratch());
  }
  /// Makes steps with the commands of step `number`.
  void Step(uint64_t number, uint32_t steps) {
    const auto* const now = commands.At(number);
    pool.Run(a.worlds, std::max<size_t>(1, a.worlds / a.threads / 8),
             [&](size_t begin, size_t end, unsigned thread) {
               if (a.ctrl.empty())
                 std::copy(
                     now + begin * a.robots, now + end * a.robots,
                     rows.columns.command.begin() + static_cast<std::ptrdiff_t>(begin * a.robots));
               for (size_t i = begin; i < end; i++) rows.Step(i, steps, scratches[thread].get());
             });
  }

  const Arguments& a;
  Stg::rows::Rows rows;
  Stg::threads::WorkerPool pool;
  std::vector<std::shared_ptr<Stg::rows::Rows::Scratch>> scratches;
  Commands commands;
};

/// Numbers of rays that hit something and of robots that stalled, in some steps.
struct Outcome {
  uint64_t stalls = 0, hits = 0, rays = 0, robots = 0;

  void Count(const Stg::rows::Columns& columns) {
    for (const uint8_t stalled : columns.stalled) stalls += stalled;
    for (const uint8_t brightness : columns.brightness) hits += brightness > 0;
    rays += columns.brightness.size();
    robots += columns.stalled.size();
  }
  void Print() const {
    if (hits == 0) Fail("no ray hits anything");
    std::printf("%.1f %% of the rays hit, %.1f %% of the robots stalled",
                100.0 * static_cast<double>(hits) / static_cast<double>(rays),
                100.0 * static_cast<double>(stalls) / static_cast<double>(robots));
  }
};

/// `casting` of the steps cast rays.
void PrintSpeed(const Arguments& a, uint64_t steps, uint64_t casting, double seconds) {
  const auto per_second = [&](uint64_t number) {
    return static_cast<double>(a.worlds * a.robots * number) / seconds / 1e6;
  };
  std::printf("%.3f M robot-steps/s, %.1f M rays/s; ", per_second(steps),
              per_second(a.rays * casting));
}

// ---- devices ------------------------------------------------------------------------------------

bool HaveEqualBits(const Stg::rows::Rows& a, const Stg::rows::Rows& b) {
  std::vector<std::vector<std::byte>> of_a, of_b;
  const auto save = [](std::vector<std::vector<std::byte>>* to) {
    return [to](int, const auto* column) {
      using T = typename std::decay_t<decltype(*column)>::value_type;
      to->emplace_back(column->size() * Stg::rows::kSizeOnDevice<T>);
      Stg::rows::ToDevice(column->data(), column->size(), to->back().data());
    };
  };
  Stg::rows::ForEachDeviceColumn(&a.columns, save(&of_a));
  Stg::rows::ForEachDeviceColumn(&b.columns, save(&of_b));
  return of_a == of_b;
}

class DeviceRun {
 public:
  DeviceRun(const Arguments& a, const std::shared_ptr<const Stg::rows::Scene>& scene,
            const std::vector<uint64_t>& seeds, Host* host)
      : a_(a), host_(*host), read_(scene, seeds), rows_(scene, a.worlds, Open(a)) {
    rows_.Write(host_.rows);
  }

  /// Makes equal steps on both, which must lead to equal bits.
  void Compare() {
    for (uint64_t step = 0; step < 32; step++) {
      Send(step);
      rows_.Step(2);
      host_.Step(step, 2);
    }
    rows_.Read(&read_);
    if (!HaveEqualBits(host_.rows, read_)) Fail("the device has other bits than the host");
  }
  void Measure() {
    MeasureLaunches();
    MeasureExchange();
    MeasureResets();
  }

 private:
  static constexpr Stg::rows::ColumnSet kReadings = 1u << Stg::ROW_RANGES |
                                                    1u << Stg::ROW_BRIGHTNESS |
                                                    1u << Stg::ROW_SENSED | 1u << Stg::ROW_STALLED;

  static std::unique_ptr<Stg::rows::RowDevice> Open(const Arguments& a) {
    const size_t equals = a.device.find('=');
    std::string message;
    auto device = Stg::rows::OpenRowDevice(
        equals == std::string::npos ? "" : a.device.substr(equals + 1), a.work_items, &message);
    if (!device) Fail(message.c_str());
    return device;
  }
  void Send(uint64_t step) {
    if (!a_.ctrl.empty()) return;
    std::copy_n(host_.commands.At(step), a_.worlds * a_.robots, read_.columns.command.begin());
    rows_.Write(read_, 1u << Stg::ROW_COMMAND);
  }
  /// Measures steps alone. New commands are sent between the measurements.
  void MeasureLaunches() {
    constexpr int kLaunches = 8;
    uint64_t steps = 0;
    double spent = 0;
    for (uint64_t moment = 0; spent < a_.seconds || moment < 4; moment++) {
      Send(moment);
      const double start = WallClock();
      for (int i = 0; i < kLaunches; i++) rows_.Step(a_.steps_of_launch);
      rows_.device().Finish();
      spent += WallClock() - start;
      steps += kLaunches * a_.steps_of_launch;
    }
    std::printf("  %s, %u steps a launch: ", rows_.device().Name().c_str(), a_.steps_of_launch);
    PrintSpeed(a_, steps, read_.scene().needs_rays ? steps : steps / a_.steps_of_launch, spent);
    rows_.Read(&read_);
    Outcome outcome;
    outcome.Count(read_.columns);
    outcome.Print();
    std::printf("\n");
  }
  void MeasureExchange() {
    uint64_t steps = 0;
    double spent = 0;
    Outcome outcome;
    while (spent < a_.seconds || steps < 8) {
      const double start = WallClock();
      Send(steps);
      rows_.Step(1);
      rows_.Read(&read_, kReadings);
      spent += WallClock() - start;
      steps++;
      outcome.Count(read_.columns);
    }
    std::printf("  with commands and readings exchanged in each step: ");
    PrintSpeed(a_, steps, steps, spent);
    outcome.Print();
    std::printf("\n");
  }
  void MeasureResets() {
    std::vector<uint32_t> worlds(a_.worlds);
    std::iota(worlds.begin(), worlds.end(), 0u);
    const std::vector<uint64_t> seeds(a_.worlds, 1);
    const double start = WallClock();
    rows_.Reset(worlds, seeds);
    rows_.device().Finish();
    std::printf("  reset in %.3f us\n",
                (WallClock() - start) * 1e6 / static_cast<double>(a_.worlds));
  }

  const Arguments& a_;
  Host& host_;
  Stg::rows::Rows read_;
  Stg::rows::DeviceRows rows_;
};

void RunDevice(const Arguments& a, const std::shared_ptr<const Stg::rows::Scene>& scene,
               const std::vector<uint64_t>& seeds) {
  if (const std::string reason = WhyNotOnDevice(scene); !reason.empty()) Fail(reason.c_str());
  Host host(a, scene, seeds);
  DeviceRun run(a, scene, seeds, &host);
  run.Compare();
  run.Measure();
}

/// Takes the options out of the arguments.
void TakeOptions(int* argc, char** argv, Arguments* a) {
  int kept = 0;
  for (int i = 0; i < *argc; i++) {
    const std::string text = argv[i];
    const std::string value = text.substr(std::min(text.size(), text.find('=') + 1));
    const auto number = static_cast<uint32_t>(std::strtoul(value.c_str(), nullptr, 10));
    if (text.starts_with("--device"))
      a->device = text;
    else if (text.starts_with("--ctrl="))
      a->ctrl = value;
    else if (text == "--objects")
      a->objects = true;
    else if (text.starts_with("--work-items="))
      a->work_items = number;
    else if (text.starts_with("--steps="))
      a->steps_of_launch = number;
    else
      argv[kept++] = argv[i];
  }
  *argc = kept;
}

/// Steps the worlds on the host.
void RunHost(const Arguments& a, const std::shared_ptr<const Stg::rows::Scene>& scene,
             const std::vector<uint64_t>& seeds) {
  double start = WallClock();
  { const Stg::rows::Rows rows(scene, seeds); }
  const double made = WallClock() - start;
  Host host(a, scene, seeds);
  uint64_t steps = 0;
  double spent = 0;
  Outcome outcome;
  while (spent < a.seconds || steps < 8) {
    start = WallClock();
    host.Step(steps, 1);
    spent += WallClock() - start;
    if (++steps % 8 == 0) outcome.Count(host.rows.columns);
  }
  start = WallClock();
  for (size_t i = 0; i < a.worlds; i++) host.rows.Reset(i, i);
  const double reset = WallClock() - start;
  std::printf(
      "%s, %zu worlds of %zu robots with %zu rays of %g m, contacts %s, rays %s, %u threads: ",
      a.scene.c_str(), a.worlds, a.robots, a.rays, a.reach, a.contacts.c_str(), a.ray_model.c_str(),
      a.threads);
  PrintSpeed(a, steps, steps, spent);
  outcome.Print();
  std::printf("; %zu bytes, made in %.2f us, reset in %.2f us\n", host.rows.BytesPerWorld(),
              made * 1e6 / static_cast<double>(a.worlds),
              reset * 1e6 / static_cast<double>(a.worlds));
}

/// Steps World objects.
void RunObjects(const Arguments& a, const std::string& text) {
  std::vector<std::unique_ptr<Stg::World>> worlds(a.worlds);
  const std::unique_ptr<Stg::World> first = Load(text, 1);
  for (size_t i = 0; i < a.worlds; i++) {
    Stg::RunOptions options;
    options.seed = i + 1;
    options.threads = 1;
    options.listed = false;
    worlds[i] = std::make_unique<Stg::World>(options);
    if (!worlds[i]->LoadCopy(*first)) Fail("a world cannot be copied");
  }
  Stg::threads::WorkerPool pool(a.threads);
  uint64_t steps = 0;
  double spent = 0;
  while (spent < a.seconds || steps < 8) {
    const double start = WallClock();
    pool.Run(a.worlds, std::max<size_t>(1, a.worlds / a.threads / 8),
             [&](size_t begin, size_t end, unsigned) {
               for (size_t i = begin; i < end; i++) worlds[i]->Update();
             });
    spent += WallClock() - start;
    steps++;
  }
  std::printf("World objects, %u threads: ", a.threads);
  PrintSpeed(a, steps, steps, spent);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  Arguments a{};
  TakeOptions(&argc, argv, &a);
  if (argc != 10)
    Fail("expected SCENE WORLDS ROBOTS RAYS REACH CONTACTS RAY_MODEL THREADS SECONDS");
  a.scene = argv[1];
  a.contacts = argv[6];
  a.ray_model = argv[7];
  a.worlds = std::strtoull(argv[2], nullptr, 10);
  a.robots = std::strtoull(argv[3], nullptr, 10);
  a.rays = std::strtoull(argv[4], nullptr, 10);
  a.reach = std::strtod(argv[5], nullptr);
  a.threads = static_cast<unsigned>(std::strtoul(argv[8], nullptr, 10));
  a.seconds = std::strtod(argv[9], nullptr);
  a.steps_of_launch = std::max(1u, a.steps_of_launch);
  const std::string text = WorldText(a);
  if (a.objects) {
    RunObjects(a, text);
    return 0;
  }
  std::string reason;
  const auto scene = Stg::RowBridge::MakeScene(Load(text, 1), &reason);
  if (!scene) Fail(reason.c_str());
  Compare(a, text, scene);
  std::vector<uint64_t> seeds(a.worlds);
  std::iota(seeds.begin(), seeds.end(), uint64_t{1});
  RunHost(a, scene, seeds);
  if (!a.device.empty()) RunDevice(a, scene, seeds);
  return 0;
}
