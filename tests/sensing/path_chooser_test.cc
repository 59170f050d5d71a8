// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/path_chooser.hh"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random_source.hh"

namespace Stg::internal::sensing {
namespace {

/// Simulates batches with known costs and sums up their durations.
class Machine {
 public:
  /// The cost of a batch of n rays is fixed + n * each, seconds.
  struct Cost {
    double fixed, each;
    double Of(uint64_t rays) const { return fixed + each * static_cast<double>(rays); }
  };

  /// `catching_up`: factor of the device's cost for a batch if the host had the previous one.
  Machine(Cost device, Cost host, double catching_up = 1)
      : device_(device), host_(host), catching_up_(catching_up) {}

  /// Runs batches. The fraction `interrupted` of them takes up to 30 times as long.
  void Run(uint64_t batches, uint64_t rays, double interrupted = 0.03) {
    for (uint64_t i = 0; i < batches; i++) {
      const bool on_device = chooser_.UseDevice(rays);
      const bool catches_up = on_device && !was_on_device_;
      const double cost = (on_device ? device_ : host_).Of(rays) * (catches_up ? catching_up_ : 1);
      was_on_device_ = on_device;
      const bool bad = random_.Real(0, 1) < interrupted;
      chooser_.Report(cost * random_.Real(0.9, 1.1) * (bad ? random_.Real(2, 30) : 1));
      taken_ += cost;
      best_ += std::min(device_.Of(rays), host_.Of(rays));
      on_device_ += on_device;
    }
  }
  /// The relative loss of time compared with using the faster path for every batch.
  double Loss() const { return taken_ / best_ - 1; }
  uint64_t on_device() const { return on_device_; }
  void Forget() { taken_ = best_ = 0, on_device_ = 0; }

 private:
  PathChooser chooser_;
  Cost device_, host_;
  double catching_up_;
  bool was_on_device_ = false;
  test::RandomSource random_{1};
  double taken_ = 0, best_ = 0;
  uint64_t on_device_ = 0;
};

constexpr Machine::Cost kGpu{60e-6, 2e-9}, kOneThread{1e-6, 150e-9};

TEST(PathChooser, LosesLittleAtAnyNumberOfRays) {
  for (const uint64_t rays : {1u, 30u, 196u, 392u, 420u, 1000u, 10000u, 3000000u}) {
    Machine machine(kGpu, kOneThread);
    machine.Run(5000, rays);
    EXPECT_LT(machine.Loss(), 0.05) << rays << ", while it is learning";
    machine.Forget();
    machine.Run(20000, rays);
    EXPECT_LT(machine.Loss(), 0.03) << rays;
  }
}

TEST(PathChooser, LosesLittleNearTheBreakEven) {
  for (const double catching_up : {1.0, 1.5, 3.0}) {
    for (uint64_t rays = 350; rays <= 450; rays += 5) {  // break-even is at 399
      Machine machine(kGpu, kOneThread, catching_up);
      machine.Run(20000, rays);
      EXPECT_LT(machine.Loss(), 0.025) << rays << " rays, " << catching_up;
    }
  }
}

/// Sensors with different intervals cause batches of different sizes.
TEST(PathChooser, ChoosesPerBatchSize) {
  struct Sizes {
    uint64_t often, seldom;
  };
  for (const auto [often, seldom] :
       {Sizes{16, 196}, {196, 1960}, {1960, 196}, {3000, 30000}, {0, 196}, {5000, 0}}) {
    for (const int period : {2, 3, 10}) {
      Machine machine(kGpu, kOneThread);
      for (int i = 0; i < 20000; i++) machine.Run(1, i % period == 0 ? seldom : often);
      EXPECT_LT(machine.Loss(), 0.03) << often << " rays, " << seldom << " every " << period;
    }
  }
}

TEST(PathChooser, FollowsTheNumberOfRays) {
  Machine machine(kGpu, kOneThread);
  machine.Run(20000, 100);
  machine.Forget();
  machine.Run(200, 100000);
  EXPECT_GT(machine.on_device(), 190u) << "a crowd must be noticed immediately";
  machine.Forget();
  machine.Run(200, 100);
  EXPECT_LT(machine.on_device(), 10u);
}

TEST(PathChooser, SaysWhenABatchIsAProbe) {
  for (const bool device_faster : {true, false}) {
    PathChooser chooser;
    uint64_t probes = 0;
    for (int i = 0; i < 2000; i++) {
      const bool on_slower = chooser.UseDevice(8000) != device_faster;
      probes += chooser.IsProbe();
      ASSERT_TRUE(chooser.IsProbe() || !on_slower);
      if (i > 10) {
        ASSERT_EQ(chooser.IsProbe(), on_slower);
      }
      const double of_a_ray = on_slower ? 2e-9 : 1e-9;
      if (chooser.IsProbe())
        chooser.Report(1000 * of_a_ray, 1000);  // an eighth
      else
        chooser.Report(8000 * of_a_ray);
    }
    EXPECT_GE(probes, 5u) << "each path at first, and the slower one later";
    EXPECT_LT(probes, 30u);
  }
}

TEST(PathChooser, NeverProbesIfItIsAlwaysTheDevice) {
  PathChooser chooser(true);
  for (int i = 0; i < 100; i++) {
    ASSERT_TRUE(chooser.UseDevice(10));
    ASSERT_FALSE(chooser.IsProbe());
    chooser.Report(1);
  }
}

/// Simulates batches of 1000 rays with a given duration on each path.
class Paths {
 public:
  Paths(double device, double host) : device_(device), host_(host) {}
  void SetDevice(double seconds) { device_ = seconds; }
  /// Sets the device's duration for a batch if the host had the previous one, and for its first
  /// two.
  void SetCatchingUp(double seconds) { catching_up_ = seconds; }
  bool Next() {
    const bool on_device = chooser_.UseDevice(1000);
    const bool catches_up = catching_up_ > 0 && (!was_on_device_ || device_batches_ < 2);
    const double cost = !on_device ? host_ : catches_up ? catching_up_ : device_;
    chooser_.Report(cost);
    taken_ += cost;
    was_on_device_ = on_device;
    device_batches_ += on_device;
    return on_device;
  }
  double taken() const { return taken_; }
  /// The number of batches until the next probe, if the host is faster.
  int UntilProbe() {
    for (int i = 1; i < 100000; i++)
      if (Next()) return i;
    ADD_FAILURE() << "there is no probe";
    return 0;
  }
  /// The number of batches of the current probe, including the one already made.
  int Probe() {
    int batches = 1;
    while (Next()) batches++;
    return batches;
  }

 private:
  PathChooser chooser_;
  double device_, host_, catching_up_ = 0, taken_ = 0;
  bool was_on_device_ = false;
  int device_batches_ = 0;
};

TEST(PathChooser, TheDevicesFirstBatchesDoNotDecide) {
  for (const double catching_up : {2.0, 20.0, 200.0}) {
    Paths paths(0.8, 1.0);
    paths.SetCatchingUp(catching_up);
    int on_device = 0;
    for (int i = 0; i < 20; i++) on_device += paths.Next();
    EXPECT_GE(on_device, 16) << catching_up;
  }
}

TEST(PathChooser, ProbeSeesBeyondTheCatchUp) {
  Paths paths(1.2, 1.0);
  paths.SetCatchingUp(10);
  for (int i = 0; i < 50; i++) paths.Next();
  paths.SetDevice(0.8);
  paths.UntilProbe();
  EXPECT_GT(paths.Probe(), 4) << "the device is the faster one now";
}

TEST(PathChooser, CatchingUpCostsLittleInTheLongRun) {
  for (const double device : {0.99, 1.01, 1.1, 3.0}) {
    Paths paths(device, 1.0);
    paths.SetCatchingUp(5);
    constexpr int kBatches = 20000;
    for (int i = 0; i < kBatches; i++) paths.Next();
    EXPECT_LT(paths.taken(), 1.008 * kBatches * std::min(device, 1.0)) << device;
  }
}

TEST(PathChooser, SlowStartIsProbedAgain) {
  Paths paths(5, 1.0);  // the device is so slow only at first
  for (int i = 0; i < 4; i++) paths.Next();
  paths.SetDevice(0.8);
  int on_device = 0;
  for (int i = 0; i < 20; i++) on_device += paths.Next();
  EXPECT_GE(on_device, 15);
}

/// In the first batch of each probe, the device must catch up.
TEST(PathChooser, ClearProbeTakesOneMoreBatch) {
  Paths paths(2.0, 1.0);
  for (int i = 0; i < 50; i++) paths.Next();  // learns
  for (int probe = 0; probe < 5; probe++) {
    EXPECT_GT(paths.UntilProbe(), 10);
    EXPECT_EQ(paths.Probe(), 2) << probe;
  }
}

TEST(PathChooser, UnclearProbeTakesThreeMoreBatches) {
  Paths paths(1.2, 1.0);
  for (int i = 0; i < 50; i++) paths.Next();
  for (int probe = 0; probe < 5; probe++) {
    EXPECT_GT(paths.UntilProbe(), 10);
    EXPECT_EQ(paths.Probe(), 4) << probe;
  }
}

TEST(PathChooser, AProbeIsClearAfterAnUnclearBatch) {
  Paths paths(1.2, 1.0);
  for (int i = 0; i < 50; i++) paths.Next();
  paths.UntilProbe();
  paths.SetDevice(5);
  EXPECT_EQ(paths.Probe(), 2) << "one less than with an unclear difference";
}

TEST(PathChooser, AProbeSeesThatThePathHasBecomeFaster) {
  Paths paths(3.0, 1.0);
  for (int i = 0; i < 50; i++) paths.Next();
  paths.SetDevice(0.1);
  paths.UntilProbe();
  EXPECT_GT(paths.Probe(), 3) << "the device is the faster one now";
}

TEST(PathChooser, AlwaysMeansAlways) {
  PathChooser always(true);
  for (int i = 0; i < 1000; i++) {
    EXPECT_TRUE(always.UseDevice(1));
    always.Report(1000);
  }
}

TEST(PathChooser, IgnoresBatchesWithoutRays) {
  PathChooser chooser;
  for (int i = 0; i < 100; i++) {
    chooser.UseDevice(0);
    chooser.Report(1);
  }
  EXPECT_TRUE(chooser.UseDevice(10)) << "the device is not known yet";
}

}  // namespace
}  // namespace Stg::internal::sensing
