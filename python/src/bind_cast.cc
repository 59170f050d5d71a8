// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "bindings.hh"
#include "gil.hh"
#include "model_handle.hh"
#include "signals.hh"
#include "text.hh"

namespace Stg::python {

namespace {

using Poses = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Ranges = nb::ndarray<double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

/// Limits of one call of RayCaster::Cast(). Apart from the ranges, its data then fits a processor's
/// caches; a device gets larger calls to keep it busy.
constexpr size_t kMaxPoses = 1 << 15, kMaxRays = 1 << 20, kMaxRaysOnDevice = 1 << 23;

void CastAll(World* world, const CastOptions& options, const Poses& poses,
             const std::vector<double>& bearings, double range, double* ranges) {
  const ErrorCollector collector;
  RayCaster caster(world, options);
  SignalChecks signals;
  const size_t max = world->statistics().device.empty() ? kMaxRays : kMaxRaysOnDevice;
  const size_t at_once =
      std::clamp<size_t>(max / std::max<size_t>(1, bearings.size()), 1, kMaxPoses);
  std::vector<Pose> part;
  for (size_t begin = 0; begin < poses.shape(0); begin += at_once) {
    const size_t end = std::min(begin + at_once, poses.shape(0));
    part.clear();
    for (size_t i = begin; i < end; i++) {
      const double* const pose = poses.data() + 3 * i;
      part.emplace_back(pose[0], pose[1], 0, pose[2]);
    }
    if (!caster.Cast(part.data(), part.size(), bearings, range, ranges + begin * bearings.size()))
      throw Failure{Kind::kStage, collector.Last("no rays can be cast")};
    signals.Poll();
  }
}

void Cast(Simulation& simulation, const Poses& poses, const std::vector<double>& bearings,
          double range, const std::optional<double>& z, bool robots,
          const std::optional<ModelHandle>& ignore, const std::string& ray_model,
          const Ranges& ranges) {
  if (ranges.shape(0) != poses.shape(0) || ranges.shape(1) != bearings.size())
    throw nb::value_error("found an array of another shape than that of the rays");
  CastOptions options;
  if (z) options.z = *z;
  options.robots = robots;
  if (ray_model == "cell") options.ray_model = RayModel::kCell;
  if (ray_model == "exact") options.ray_model = RayModel::kExact;
  if (ignore && ignore->simulation().get() != &simulation)
    throw Failure{Kind::kGone, "the model to be ignored is in another world"};
  simulation.With([&](World& world) {
    if (ignore) options.from = simulation.Find(0, ignore->key());
    const GilRelease no_gil;
    CastAll(&world, options, poses, bearings, range, ranges.data());
  });
}

}  // namespace

void BindCast(nb::class_<Simulation>& world) {
  world.def("cast", &Cast, nb::arg("poses"), nb::arg("bearings"), nb::arg("range"),
            nb::arg("z").none(), nb::arg("robots"), nb::arg("ignore").none(), nb::arg("ray_model"),
            nb::arg("to"));
}

}  // namespace Stg::python
