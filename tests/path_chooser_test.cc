// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/path_chooser.hh"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random_source.hh"

namespace Stg {
namespace {

/// Runs batches whose cost is known, and sums up what they took.
class Machine {
 public:
  /// Seconds for a batch of n rays: fixed + n * each.
  struct Cost {
    double fixed, each;
    double Of(uint64_t rays) const { return fixed + each * static_cast<double>(rays); }
  };

  Machine(Cost device, Cost host) : device_(device), host_(host) {}

  /// Some batches are interrupted and take up to 30 times as long.
  void Run(uint64_t batches, uint64_t rays, double interrupted = 0.03) {
    for (uint64_t i = 0; i < batches; i++) {
      const bool on_device = chooser_.UseDevice(rays);
      const double cost = (on_device ? device_ : host_).Of(rays);
      const bool bad = random_.Real(0, 1) < interrupted;
      chooser_.Report(cost * random_.Real(0.9, 1.1) * (bad ? random_.Real(2, 30) : 1));
      taken_ += cost;
      best_ += std::min(device_.Of(rays), host_.Of(rays));
      on_device_ += on_device;
    }
  }
  /// How much longer all took than if every batch had been on the faster path.
  double Loss() const { return taken_ / best_ - 1; }
  uint64_t on_device() const { return on_device_; }
  void Forget() { taken_ = best_ = 0, on_device_ = 0; }

 private:
  PathChooser chooser_;
  Cost device_, host_;
  test::RandomSource random_{1};
  double taken_ = 0, best_ = 0;
  uint64_t on_device_ = 0;
};

constexpr Machine::Cost kGpu{60e-6, 2e-9}, kOneThread{1e-6, 150e-9};

TEST(PathChooser, LosesLittleAtAnyNumberOfRays) {
  for (const uint64_t rays : {1u, 30u, 196u, 392u, 420u, 1000u, 10000u, 3000000u}) {
    Machine machine(kGpu, kOneThread);
    machine.Run(5000, rays);
    EXPECT_LT(machine.Loss(), 0.1) << rays << ", while it is learning";
    machine.Forget();
    machine.Run(20000, rays);
    EXPECT_LT(machine.Loss(), 0.03) << rays;
  }
}

TEST(PathChooser, FollowsTheNumberOfRays) {
  Machine machine(kGpu, kOneThread);
  machine.Run(20000, 100);
  machine.Forget();
  machine.Run(200, 100000);
  EXPECT_GT(machine.on_device(), 190u) << "it is to notice a crowd at once";
  machine.Forget();
  machine.Run(200, 100);
  EXPECT_LT(machine.on_device(), 10u);
}

TEST(PathChooser, AlwaysMeansAlways) {
  PathChooser always(true);
  for (int i = 0; i < 1000; i++) {
    EXPECT_TRUE(always.UseDevice(1));
    always.Report(1000);
  }
}

TEST(PathChooser, BatchesWithoutRaysTeachNothing) {
  PathChooser chooser;
  for (int i = 0; i < 100; i++) {
    chooser.UseDevice(0);
    chooser.Report(1);
  }
  EXPECT_TRUE(chooser.UseDevice(10)) << "the device is not known yet";
}

}  // namespace
}  // namespace Stg
