// SPDX-License-Identifier: GPL-2.0-or-later
//
// Extremes of time, speed and energy: steps from a microsecond to an hour, clocks after 1e8 steps,
// ten million steps along a circle, speeds that pass a wall in one step, ten million withdrawals.
// Each test verifies a row of docs/extremes.md.

#include <complex>

#include "extremes_testing.hh"
#include "support/sanitized.hh"

namespace Stg::extremes {
namespace {

constexpr usec_t kHour = 3600000000u;

constexpr int kManySteps = kSanitized ? 500000 : 10000000;

void StepMany(World& world, int count) {
  for (int i = 0; i < count; i++) ASSERT_FALSE(world.Update());
}

ModelPosition* AddRobot(World* world, const Pose& pose, const Size& size) {
  auto* robot = dynamic_cast<ModelPosition*>(world->CreateModel(nullptr, "position"));
  robot->SetGeom(Geom(Pose(), size));
  robot->SetPose(pose);
  for (Bounds& bounds : robot->velocity_bounds) bounds = Bounds(-kInfinity, kInfinity);
  robot->Subscribe();
  return robot;
}

/// A world whose clock can be set, as if it had run for a long time.
class LateWorld : public World {
 public:
  void SetClock(usec_t time, uint64_t steps) {
    sim_time = time;
    updates = steps;
  }
};

// ---- steps --------------------------------------------------------------------------------------

TEST(Steps, FromAMicrosecondToAnHour) {
  struct {
    const char* milliseconds;
    usec_t step;
  } const cases[] = {{"0.001", 1},    {"0.0019", 1},      {"0.5", 500},
                     {"100", 100000}, {"1001", 1001000},  {"3600000", kHour},
                     {"0.249", 249},  {"33.3333", 33333}, {"86400000", 24 * kHour}};
  for (const auto& c : cases) {
    const auto world =
        LoadText(std::string("interval_sim ") + c.milliseconds +
                 "\nposition( name \"r\" update_interval 0 joules 10 ranger( name \"eye\""
                 " update_interval 0 sensor( range [0 4] ) ) )\n"
                 "model( pose [0 5 0 0] )\n");
    EXPECT_EQ(world->sim_interval, c.step) << c.milliseconds;
    auto* robot = FindRunning<ModelPosition>(*world, "r");
    auto* eye = FindRunning<ModelRanger>(*world, "r.eye");
    robot->SetSpeed(0.75, 0, 0);
    Step(*world, 7);
    EXPECT_EQ(world->SimTimeNow(), 7 * c.step);
    const double way = 7 * 0.75 * static_cast<double>(c.step) / 1e6;
    EXPECT_NEAR(robot->GetPose().x, way, 1e-15 * way) << c.milliseconds;
    EXPECT_EQ(eye->GetSensors()[0].ranges.size(), 1u);
    EXPECT_NEAR(robot->FindPowerPack()->GetStored(), 10 - 7 * 0.12, 1e-12)
        << "energy per step does not depend on its length";
  }
}

TEST(Steps, WholeMicrosecondsAreExact) {
  // In floating point, 1.001 * 1000 is less than 1001.
  for (const int us : {1, 999, 1001, 1003, 1019, 2007, 4011, 8191, 16387, 32771, 99999}) {
    const std::string text = std::to_string(us / 1000) + "." + std::to_string(1000 + us % 1000);
    const auto world = LoadText("interval_sim " + text.substr(0, text.find('.') + 1) +
                                text.substr(text.size() - 3));
    EXPECT_EQ(world->sim_interval, static_cast<usec_t>(us)) << text;
  }
  for (const char* seconds : {"0.000249", "0.000251", "0.000489", "1.000001"}) {
    const auto world = LoadText(std::string("quit_time ") + seconds);
    EXPECT_EQ(static_cast<double>(world->GetQuitTime()), std::round(std::stod(seconds) * 1e6));
  }
}

TEST(Steps, UnrepresentableAreRefused) {
  for (const char* step : {"0", "-1", "0.0009", "\"2e16\"", "\"1e300\"", "\"inf\""}) {
    const LoadOutcome outcome = TryToLoad(std::string("interval_sim ") + step);
    EXPECT_FALSE(outcome.loaded) << step;
    EXPECT_EQ(outcome.errors.rfind("t.world:1:14: ", 0), 0u) << outcome.errors;
  }
  for (const char* never : {"0", "-5", "\"1e300\"", "0.0000001"})
    EXPECT_EQ(LoadText(std::string("quit_time ") + never)->GetQuitTime(), 0u) << never;
}

// ---- the clock ----------------------------------------------------------------------------------

TEST(Clock, AMillionSteps) {
  const std::unique_ptr<World> world = EmptyWorld();
  for (const usec_t step : {usec_t{1}, usec_t{33333}, kHour}) {
    const usec_t before = world->SimTimeNow();
    world->sim_interval = step;
    StepMany(*world, kManySteps / 10);
    EXPECT_EQ(world->SimTimeNow() - before, step * (kManySteps / 10));
  }
  EXPECT_EQ(world->GetUpdateCount(), 3u * (kManySteps / 10));
}

int NoteTime(Model* model, void* times) {
  static_cast<std::vector<usec_t>*>(times)->push_back(model->GetWorld()->SimTimeNow());
  return 0;
}

TEST(Clock, AfterAHundredMillionHours) {
  InitLibrary();
  LateWorld world;
  const usec_t begin = 100000000 * kHour + 7;
  world.SetClock(begin, 100000000);
  world.sim_interval = 1000;
  EXPECT_EQ(world.ClockString(), "100000000h 0m 00s 000msec");
  ModelPosition* robot = AddRobot(&world, Pose(), Size(0.4, 0.4, 1));
  std::vector<usec_t> times, rang;
  robot->AddCallback(Model::CB_UPDATE, NoteTime, &times);
  world.Enqueue(0, 2500, robot, NoteTime, &rang);
  world.Enqueue(0, std::numeric_limits<usec_t>::max(), robot, NoteTime, &rang);  // never
  robot->SetAcceleration(0.5, 0, 0);
  StepMany(world, 1000);
  EXPECT_EQ(world.SimTimeNow(), begin + 1000000);
  EXPECT_EQ(world.GetUpdateCount(), 100001000u);
  ASSERT_EQ(times.size(), 10u);  // every 100 ms
  for (size_t i = 0; i < times.size(); i++) EXPECT_EQ(times[i], begin + (i + 1) * 100000);
  EXPECT_EQ(rang, std::vector<usec_t>{begin + 3000});
  EXPECT_NEAR(robot->GetVelocity().x, 0.5, 1e-12);  // needs the exact time between updates
  world.SetQuitTime(begin + 1002000);
  StepMany(world, 2);
  EXPECT_TRUE(world.Update());
}

// ---- speeds -------------------------------------------------------------------------------------

TEST(Speeds, FromTinyToHuge) {
  for (const double speed : {1e-300, 1e-9, 1e-3, 1.0, 1e6, 3e8}) {
    const std::unique_ptr<World> world = EmptyWorld();
    ModelPosition* robot = AddRobot(world.get(), Pose(), Size(0.4, 0.4, 1));
    robot->SetSpeed(speed, 0, 0);
    StepMany(*world, 1000);
    EXPECT_NEAR(robot->GetPose().x / (100 * speed), 1, 1e-13) << speed;
    EXPECT_FALSE(robot->Stalled());
  }
}

TEST(Speeds, BelowTheRoundingOfAPoseDoNotMove) {
  const std::unique_ptr<World> world = EmptyWorld();
  ModelPosition* robot = AddRobot(world.get(), Pose(1e6, 0, 0, 0), Size(0.4, 0.4, 1));
  robot->SetSpeed(1e-10, 0, 0);  // 1e-11 m per step; doubles at 1e6 are 1e-10 apart
  StepMany(*world, 100);
  EXPECT_EQ(robot->GetPose().x, 1e6);
  robot->SetSpeed(1e-8, 0, 0);
  StepMany(*world, 100);
  EXPECT_NEAR(robot->GetPose().x, 1e6 + 1e-7, 1e-8);
}

TEST(Speeds, OverflowingPosesStall) {
  const std::unique_ptr<World> world = EmptyWorld();
  ModelPosition* robot = AddRobot(world.get(), Pose(), Size(0.4, 0.4, 1));
  for (const double speed : {1.7e308, kInfinity, -kInfinity}) {
    robot->SetSpeed(speed, 0, 0);
    world->sim_interval = kHour;
    StepMany(*world, 3);
    EXPECT_TRUE(robot->Stalled());
    ExpectPose(robot->GetPose(), 0, 0, 0, 0, 0);
    EXPECT_TRUE(IsFinite(robot->est_pose));
  }
  robot->SetSpeed(1, 0, 0);
  StepMany(*world, 1);
  EXPECT_NEAR(robot->GetPose().x, 3600, 1e-9);
}

// ---- walls in one step --------------------------------------------------------------------------

/// Drives a robot of 0.4 m from `start` along `heading`, in steps of `step` metres, against a wall
/// without thickness at the origin. Returns true if the wall stops it.
bool WallStops(ContactModel contacts, double start, double step, double heading) {
  const std::unique_ptr<World> world = EmptyWorld();
  world->SetContactModel(contacts);
  AddBox(world.get(), Size(0, 6, 1), Pose(0.011, 0, 0, 0));
  ModelPosition* robot =
      AddRobot(world.get(), Pose(start * std::cos(heading), start * std::sin(heading), 0, heading),
               Size(0.4, 0.4, 1));
  world->sim_interval = static_cast<usec_t>(step * 1e6);
  robot->SetSpeed(1, 0, 0);
  while (!robot->Stalled() && robot->GetPose().x < 1) EXPECT_FALSE(world->Update());
  return robot->Stalled();
}

TEST(Tunnelling, IsImpossibleInStepsShorterThanTheBody) {
  for (const ContactModel contacts : {ContactModel::kCells, ContactModel::kOutlines})
    for (const double step : {0.01, 0.1, 0.3, 0.35})
      for (const double heading : {0.0, 0.5, -1.0})
        for (double start = -2; start < -2 + step; start += step / 17)
          EXPECT_TRUE(WallStops(contacts, start, step, heading))
              << step << " " << heading << " " << start;
}

TEST(Tunnelling, OfCellsIsPossibleInLongerSteps) {
  // Only the end position of a step is tested for collisions. From -2, steps of 1.3 end at -0.7 and
  // 0.6, both clear of the wall. From -1.4, a step ends at the wall.
  EXPECT_FALSE(WallStops(ContactModel::kCells, -2, 1.3, 0));
  EXPECT_TRUE(WallStops(ContactModel::kCells, -1.4, 1.3, 0));
}

TEST(Tunnelling, OfOutlinesIsImpossibleInStepsOfAnyLength) {
  for (const double step : {1.0, 1.3, 5.0, 50.0})
    for (const double heading : {0.0, 0.5, -1.0})
      for (const double start : {-2.0, -1.4, -0.9})
        EXPECT_TRUE(WallStops(ContactModel::kOutlines, start, step, heading))
            << step << " " << heading << " " << start;
}

// ---- ten million steps --------------------------------------------------------------------------

using Complex = std::complex<long double>;

/// The sum of z^k for k = 0 .. n - 1, where z = exp(i angle).
Complex SumOfPowers(long double angle, int n) {
  return std::polar(1.0L, angle * (n - 1) / 2) * (std::sin(angle * n / 2) / std::sin(angle / 2));
}

TEST(Drift, OfTenMillionStepsAlongACircle) {
  const auto world = LoadText(
      "position( name \"r\" noblocks 1 localization \"odom\" odom_error [0 0 0 0]"
      " joules 100000000 )\n");
  auto* robot = FindRunning<ModelPosition>(*world, "r");
  const double speed = 0.5, turn = 0.3;
  robot->SetSpeed(speed, 0, turn);
  StepMany(*world, kManySteps);

  // Each step moves along the old heading and then turns; the estimate is the pose before the last
  // move.
  const long double angle = static_cast<long double>(turn) * 0.1L, step = speed * 0.1L;
  const Complex there = step * SumOfPowers(angle, kManySteps);
  const Complex believed = step * SumOfPowers(angle, kManySteps - 1);
  Worst pose, odometry, heading, energy;
  pose.Note(std::hypot(robot->GetPose().x - static_cast<double>(there.real()),
                       robot->GetPose().y - static_cast<double>(there.imag())));
  odometry.Note(std::hypot(robot->est_pose.x - static_cast<double>(believed.real()),
                           robot->est_pose.y - static_cast<double>(believed.imag())));
  const double expected = static_cast<double>(std::arg(std::polar(1.0L, angle * kManySteps)));
  heading.Note(std::remainder(robot->GetPose().a - expected, 2 * M_PI));
  pose.Record("metres");
  odometry.Record("metres_of_odometry");
  heading.Record("radians");
  // Rounding of headings rotates the circle about its center; rounding of the sums is added.
  const double radius = speed / turn;
  EXPECT_LE(heading.value(), 1.5e-15 * kManySteps);
  EXPECT_LE(pose.value(), radius * 4e-15 * kManySteps);
  EXPECT_LE(odometry.value(), radius * 4e-15 * kManySteps);

  // The consumption is 1 W for kManySteps times 0.1 s.
  const PowerPack& pack = *robot->FindPowerPack();
  const double drawn = 0.1 * kManySteps;
  energy.Note((1e8 - pack.GetStored()) / drawn - 1);
  energy.Note(pack.GetDissipated() / drawn - 1);
  energy.Record("share_of_the_energy");
  EXPECT_LE(energy.value(), 1e8 * 1.2e-16 / 0.1);
}

// ---- energy -------------------------------------------------------------------------------------

struct Energy {
  explicit Energy() : world(EmptyWorld()), pack(world->CreateModel(nullptr, "model")) {}
  std::unique_ptr<World> world;
  PowerPack pack;
};

TEST(Energy, TenMillionWithdrawals) {
  for (const double stored : {1e6, 1e9, 1e12}) {
    Energy e;
    e.pack.SetCapacity(stored);
    e.pack.SetStored(stored);
    const double each = 0.013;
    for (int i = 0; i < kManySteps; i++) e.pack.Dissipate(each);
    // Each withdrawal is rounded with a relative error of at most half of 2.2e-16 of the remaining
    // energy.
    const double most = kManySteps * stored * 1.2e-16;
    EXPECT_NEAR(e.pack.GetStored(), stored - each * kManySteps, most) << stored;
    EXPECT_NEAR(e.pack.GetDissipated(), each * kManySteps,
                kManySteps * (each * kManySteps) * 1.2e-16);
    EXPECT_GE(e.pack.GetStored(), 0);
  }
}

TEST(Energy, IsNeverBelowZeroNorAboveTheCapacity) {
  Energy e;
  e.pack.SetCapacity(1);
  for (int i = 0; i < 1000; i++) {
    e.pack.Add(0.3);
    EXPECT_LE(e.pack.GetStored(), 1);
    e.pack.Dissipate(0.7);
    EXPECT_GE(e.pack.GetStored(), 0);
  }
  for (const double amount : {1e300, kInfinity}) {
    e.pack.Add(amount);
    EXPECT_EQ(e.pack.GetStored(), 1);
    e.pack.Dissipate(amount);
    EXPECT_EQ(e.pack.GetStored(), 0);
  }
}

TEST(Energy, HandlesZeroInfiniteAndNegativeCapacities) {
  Energy e;
  e.pack.Add(5);
  EXPECT_EQ(e.pack.GetStored(), 0);
  e.pack.Dissipate(5);
  EXPECT_EQ(e.pack.GetDissipated(), 0);

  e.pack.SetCapacity(kInfinity);
  e.pack.Add(1e12);
  EXPECT_EQ(e.pack.GetStored(), 1e12);
  EXPECT_EQ(e.pack.RemainingCapacity(), kInfinity);
  EXPECT_EQ(e.pack.ProportionRemaining(), 0);
  e.pack.Add(kInfinity);  // an infinite amount is ignored
  EXPECT_EQ(e.pack.GetStored(), 1e12);

  e.pack.SetCapacity(-1);  // -1 means an infinite supply
  EXPECT_EQ(e.pack.GetStored(), -1);
  e.pack.Dissipate(7);
  EXPECT_EQ(e.pack.GetStored(), -1);
  EXPECT_EQ(e.pack.GetDissipated(), 7);
}

TEST(Energy, InfiniteStoresAreSupplies) {
  const double stored = PowerPack::global_stored, capacity = PowerPack::global_capacity;
  {
    Energy giver, taker;
    giver.pack.SetCapacity(kInfinity);
    giver.pack.SetStored(kInfinity);
    taker.pack.SetCapacity(kInfinity);
    EXPECT_EQ(giver.pack.ProportionRemaining(), 1);
    EXPECT_EQ(giver.pack.RemainingCapacity(), 0);
    giver.pack.Add(5);
    giver.pack.TransferTo(&taker.pack, 5);
    giver.pack.TransferTo(&taker.pack, kInfinity);
    giver.pack.Dissipate(2);
    giver.pack.Dissipate(kInfinity);
    EXPECT_EQ(taker.pack.GetStored(), 5);
    EXPECT_EQ(giver.pack.GetStored(), kInfinity);
    EXPECT_EQ(giver.pack.GetDissipated(), 2);
    EXPECT_EQ(PowerPack::global_stored, stored + 5);
    EXPECT_EQ(PowerPack::global_capacity, capacity);
  }
  EXPECT_EQ(PowerPack::global_stored, stored);
  EXPECT_EQ(PowerPack::global_capacity, capacity);
  EXPECT_TRUE(std::isfinite(PowerPack::global_input));
  EXPECT_TRUE(std::isfinite(PowerPack::global_dissipated));
}

}  // namespace
}  // namespace Stg::extremes
