// SPDX-License-Identifier: GPL-2.0-or-later
//
// How many rays a second RayCaster casts on the map of the hospital, from poses within half a metre
// of one another, as a particle filter's are, and all over the map.
//
//   build/release/benchmarks/casting [THREADS [DEVICE]]
//
// With a DEVICE, as after --opencl=, rays go there wherever that is faster; the time of a call has
// the transfers in it. Prints million rays a second: median, smallest and largest of the repeats.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "stage.hh"

namespace {

constexpr int kRepeats = 9;
constexpr double kRange = 30;

double Now() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

std::vector<Stg::Pose> Poses(size_t count, double spread) {
  Stg::RandomStream random(1);
  std::vector<Stg::Pose> poses;
  for (size_t i = 0; i < count; i++)
    poses.emplace_back(random.Uniform(-spread, spread), random.Uniform(-spread, spread), 0,
                       random.Uniform(-M_PI, M_PI));
  return poses;
}

void Measure(const Stg::World& world, Stg::RayCaster* caster, size_t count, size_t rays,
             double spread) {
  const std::vector<Stg::Pose> poses = Poses(count, spread);
  std::vector<double> bearings, ranges(count * rays), rates;
  for (size_t i = 0; i < rays; i++)
    bearings.push_back(2 * M_PI * static_cast<double>(i) / static_cast<double>(rays) - M_PI);
  const auto before = world.statistics().prefilter;
  for (int i = 0; i <= kRepeats; i++) {
    const double start = Now();
    if (!caster->Cast(poses.data(), count, bearings, kRange, ranges.data())) std::exit(1);
    if (i > 0) rates.push_back(static_cast<double>(count * rays) / (Now() - start) / 1e6);
  }
  std::sort(rates.begin(), rates.end());
  std::printf("%8zu poses within %4g m, %4zu rays of %g m: %8.1f M rays/s (%.1f to %.1f)", count,
              spread, rays, kRange, rates[rates.size() / 2], rates.front(), rates.back());
  const auto after = world.statistics().prefilter;
  const auto ms = [](double from, double to) { return 1e3 * (to - from) / (kRepeats + 1); };
  if (!world.statistics().device.empty())
    std::printf("; device: sent in %.2f, waited for %.2f + %.2f ms",
                ms(before.send_seconds, after.send_seconds),
                ms(before.walk_seconds, after.walk_seconds),
                ms(before.fetch_seconds, after.fetch_seconds));
  std::printf("\n");
}

}  // namespace

int main(int argc, char* argv[]) {
  Stg::Init(&argc, &argv);
  Stg::RunOptions options;
  options.threads = argc > 1 ? std::atoi(argv[1]) : 1;
  options.opencl = argc > 2;
  if (options.opencl) options.device = argv[2];
  Stg::World world(options);
  if (!world.Load(STAGE_SOURCE_WORLDS "/hospital.world")) return 1;
  Stg::RayCaster caster(&world);
  for (const double spread : {0.5, 15.0}) {
    Measure(world, &caster, 4000, 60, spread);
    Measure(world, &caster, 20000, 360, spread);
    Measure(world, &caster, 100000, 360, spread);
  }
  std::printf("device: %s, of %llu steps %llu on it\n", world.statistics().device.c_str(),
              static_cast<unsigned long long>(world.statistics().steps),
              static_cast<unsigned long long>(world.statistics().device_steps));
  return 0;
}
