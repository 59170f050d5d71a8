// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "batch.hh"
#include "bindings.hh"
#include "crowd.hh"
#include "gil.hh"
#include "picture.hh"
#include "rows/row_bridge.hh"
#include "text.hh"

namespace Stg::python {

namespace {

using Poses = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using Commands = nb::ndarray<const double, nb::shape<-1, -1, -1, 3>, nb::c_contig, nb::device::cpu>;
using Live = nb::ndarray<nb::ro, nb::c_contig, nb::device::cpu>;
using Recorded = nb::ndarray<bool, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using Written = nb::ndarray<nb::c_contig, nb::device::cpu>;

/// For each variant the ids of its robots, or none.
using RobotIds = std::vector<std::vector<std::optional<uint32_t>>>;

Crowd::Robots KeysOf(const std::vector<std::optional<uint32_t>>& ids) {
  Crowd::Robots robots;
  for (const std::optional<uint32_t>& id : ids)
    robots.push_back(id ? ModelKey{*id, 0} : Crowd::kNoRobot);
  return robots;
}

/// Numbers of models, of sensors of their rangers and of numbers of properties, which have these
/// names.
std::vector<rows::VariedNumber> VariedNumbers(const std::vector<std::vector<uint32_t>>& varied,
                                              const std::vector<std::string>& properties) {
  const auto is_whole = [](const auto& number) { return number.size() == 3; };
  if (varied.size() != properties.size() || !std::ranges::all_of(varied, is_whole))
    throw nb::value_error("found other numbers than three for each property");
  std::vector<rows::VariedNumber> numbers;
  for (size_t i = 0; i < varied.size(); i++)
    numbers.push_back(
        {varied[i][0], varied[i][1], RowBridge::FindProperty(properties[i]), varied[i][2]});
  return numbers;
}

void SetPrototype(Batch& batch, uint32_t variant, Simulation& prototype,
                  const std::vector<std::optional<uint32_t>>& ids,
                  const std::vector<std::vector<uint32_t>>& varied,
                  const std::vector<std::string>& properties) {
  const std::vector<rows::VariedNumber> numbers = VariedNumbers(varied, properties);
  const auto can_vary = [&](World& world) {
    return std::ranges::all_of(
        numbers, [&](const auto& number) { return RowBridge::CanVary(world, number); });
  };
  if (!prototype.With(can_vary)) throw nb::value_error("found a number that rows can't vary");
  if (ids.size() != batch.crowd()->size())
    throw nb::value_error("found another number of ids than there are robots");
  Logged([&] { batch.SetPrototype(variant, &prototype, KeysOf(ids), numbers); });
}

std::shared_ptr<Batch> Make(const std::vector<std::shared_ptr<Simulation>>& prototypes,
                            const std::vector<uint64_t>& seeds,
                            const std::vector<uint32_t>& variants, unsigned threads,
                            const RobotIds& ids, const std::optional<std::string>& device,
                            const std::vector<std::string>& placed, bool branch) {
  return Logged([&] {
    std::vector<Simulation*> pointers;
    for (const auto& prototype : prototypes) pointers.push_back(prototype.get());
    const auto batch =
        std::make_shared<Batch>(pointers, seeds, variants, threads, device, placed, branch);
    std::vector<Crowd::Robots> robots;
    for (const auto& of_variant : ids) robots.push_back(KeysOf(of_variant));
    batch->MakeCrowd(robots, prototypes.size() == 1);
    return batch;
  });
}

/// A new batch of worlds of the same variants, with arrays of the same robots.
std::shared_ptr<Batch> MakeAnother(Batch& batch, const std::vector<uint64_t>& seeds) {
  return Logged([&] {
    const auto another = std::make_shared<Batch>(&batch, seeds);
    another->MakeCrowd(batch.crowd()->robots(), batch.device_crowd() != nullptr);
    return another;
  });
}

/// Only the sizes of the arrays are checked here; the Python caller guarantees their shapes.
void Rollout(Batch& batch, size_t moments, uint64_t steps, const std::optional<Commands>& commands,
             const std::vector<Live>& live, const std::vector<Written>& to,
             const Recorded& recorded) {
  std::vector<Batch::Record> records;
  for (size_t i = 0; i < live.size(); i++) {
    if (to[i].nbytes() != moments * live[i].nbytes())
      throw nb::value_error("found an array of another size than is to be recorded");
    records.push_back({static_cast<const char*>(live[i].data()), static_cast<char*>(to[i].data()),
                       live[i].nbytes() / batch.size()});
  }
  if (commands && commands->size() != moments * batch.size() * batch.crowd()->size() * 3)
    throw nb::value_error("found another number of commands than there are robots");
  if (recorded.shape(0) != moments || recorded.shape(1) != batch.size())
    throw nb::value_error("found another number of flags than there are moments and worlds");
  Logged([&] {
    batch.Rollout(commands ? commands->data() : nullptr, moments, steps, records, recorded.data());
  });
}

void Teleport(Batch& batch, const Poses& poses, const Mask& which) {
  if (poses.shape(0) != batch.size() || poses.shape(1) != batch.crowd()->size() ||
      which.size() * 3 != poses.size())
    throw nb::value_error("found another number of poses than there are robots");
  batch.Teleport(poses.data(), which.data());
}

void CheckPlaced(const Batch& batch, const Batch::PlacedIds& models, size_t worlds, size_t count) {
  const auto fits = [&](const auto& ids) { return ids.size() == count; };
  if (worlds != batch.size() || models.size() != batch.variants() ||
      !std::ranges::all_of(models, fits))
    throw nb::value_error("found another number of poses than there are models");
}

void Place(Batch& batch, const Batch::PlacedIds& models, const Poses& poses, const Mask& which) {
  CheckPlaced(batch, models, poses.shape(0), poses.shape(1));
  if (which.size() * 3 != poses.size())
    throw nb::value_error("found another number of flags than of poses");
  Logged([&] { batch.Place(models, poses.data(), which.data()); });
}

using WrittenPoses = nb::ndarray<double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

void FindPlaces(Batch& batch, const Batch::PlacedIds& models, const WrittenPoses& to) {
  CheckPlaced(batch, models, to.shape(0), to.shape(1));
  Logged([&] { batch.FindPlaces(models, to.data()); });
}

using CardPoses = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cuda>;
using CardMask = nb::ndarray<const bool, nb::shape<-1, -1>, nb::c_contig, nb::device::cuda>;
using CardFlags = nb::ndarray<const bool, nb::shape<-1>, nb::c_contig, nb::device::cuda>;

template <class Tensor>
rows::RowInput InputOf(const Tensor& tensor) {
  return {tensor.data(), tensor.nbytes(), true};
}

void TeleportOnCard(Batch& batch, const CardPoses& poses, const CardMask& which) {
  if (poses.shape(0) != batch.size() || poses.shape(1) != batch.crowd()->size() ||
      which.size() * 3 != poses.size())
    throw nb::value_error("found another number of poses than there are robots");
  Logged([&] { batch.TeleportFlagged(InputOf(poses), InputOf(which)); });
}

bool ResetOnCard(Batch& batch, const CardFlags& flags) {
  if (flags.size() != batch.size())
    throw nb::value_error("found another number of flags than there are worlds");
  return Logged([&] { return batch.ResetFlagged(InputOf(flags)); });
}

using Numbers = nb::ndarray<const uint32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

Batch::Indices IndicesOf(const Numbers& which) {
  return {which.data(), which.data() + which.shape(0)};
}

using Seeds = nb::ndarray<const uint64_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

using Values = nb::ndarray<const double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

/// Resets worlds, each with its own seed, variant and values; none: with those that it has.
void Reset(Batch& batch, const Numbers& which, const std::optional<Seeds>& seeds,
           const std::optional<Numbers>& variants, const std::optional<Values>& values) {
  if ((seeds && seeds->size() != which.size()) || (variants && variants->size() != which.size()))
    throw nb::value_error("found another number of seeds or variants than there are worlds");
  std::optional<std::vector<uint64_t>> new_seeds;
  if (seeds) new_seeds.emplace(seeds->data(), seeds->data() + seeds->size());
  std::optional<Batch::Indices> new_variants;
  if (variants) new_variants = IndicesOf(*variants);
  if (values && (!variants || values->shape(0) != which.shape(0)))
    throw nb::value_error("found values for another number of worlds, or without variants");
  std::optional<PoolAccess::OwnValues> given;
  if (values) given = PoolAccess::OwnValues{values->data(), values->shape(1)};
  Logged([&] { batch.Reset(IndicesOf(which), new_seeds, new_variants, given); });
}

/// Makes worlds on a device, whose variants must be the same, those of other variants in which more
/// numbers vary, with these values.
void CarryToVariants(Batch& batch, const Numbers& variants, const Values& values) {
  const Batch::Indices to = IndicesOf(variants);
  const auto is_other = [&](uint32_t variant) { return variant != to[0]; };
  if (!batch.device_crowd()) throw Failure{Kind::kStage, "the worlds are not on a device"};
  if (to.size() != batch.size() || values.shape(0) != batch.size())
    throw nb::value_error("found variants or values for another number of worlds");
  if (std::ranges::any_of(to, is_other) || to[0] >= batch.pool()->CountVariants())
    throw nb::value_error("found several variants, or one that does not exist");
  Logged([&] { batch.CarryToVariant(to[0], {values.data(), values.shape(1)}); });
}

using CastPoses = nb::ndarray<const double, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;
using Ranges = nb::ndarray<double, nb::shape<-1, -1, -1>, nb::c_contig, nb::device::cpu>;

void CastRays(Batch& batch, const Numbers& which, const CastPoses& poses,
              const std::vector<double>& bearings, double range, const std::optional<double>& z,
              bool robots, const Numbers& ignored, const std::string& ray_model,
              const Ranges& ranges) {
  if (poses.shape(0) != which.size() || ignored.size() != poses.shape(1) ||
      ranges.shape(0) != which.size() || ranges.shape(1) != poses.shape(1) ||
      ranges.shape(2) != bearings.size())
    throw nb::value_error("found an array of another shape than that of the rays");
  Batch::Cast cast{{}, range, bearings, IndicesOf(ignored)};
  if (z) cast.options.z = *z;
  cast.options.robots = robots;
  if (ray_model == "cell") cast.options.ray_model = RayModel::kCell;
  if (ray_model == "exact") cast.options.ray_model = RayModel::kExact;
  Logged([&] { batch.CastRays(IndicesOf(which), cast, poses.data(), ranges.data()); });
}

using Pairs = nb::ndarray<int64_t, nb::shape<-1, -1, 2>, nb::c_contig, nb::device::cpu>;
using Fives = nb::ndarray<double, nb::shape<-1, -1, 5>, nb::c_contig, nb::device::cpu>;

void FindContacts(Batch& batch, const Numbers& which, const Pairs& models, const Pairs& robots,
                  const Fives& numbers) {
  for (const size_t axis : {0, 1})
    if (robots.shape(axis) != models.shape(axis) || numbers.shape(axis) != models.shape(axis) ||
        models.shape(0) != which.size())
      throw nb::value_error("found arrays of different shapes for contacts");
  Logged([&] {
    batch.FindContacts(IndicesOf(which),
                       {models.shape(1), models.data(), robots.data(), numbers.data()});
  });
}

using States = nb::ndarray<const uint64_t, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using WrittenStates = nb::ndarray<uint64_t, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;

std::vector<uint64_t> KeysFor(const Batch& batch, const Seeds& keys) {
  if (keys.size() != batch.variants())
    throw nb::value_error("found another number of keys than there are variants");
  return {keys.data(), keys.data() + keys.size()};
}

size_t CountStateWords(Batch& batch, const Numbers& which, const Seeds& keys) {
  return Logged([&] { return batch.CountStateWords(IndicesOf(which), KeysFor(batch, keys)); });
}

/// The caller has got the width from CountStateWords().
void SaveStates(Batch& batch, const Numbers& which, const Seeds& keys, const WrittenStates& to) {
  if (to.shape(0) != which.size())
    throw nb::value_error("found an array for another number of states than there are worlds");
  Logged([&] { batch.SaveStates(IndicesOf(which), KeysFor(batch, keys), to.shape(1), to.data()); });
}

void LoadStates(Batch& batch, const Numbers& which, const Seeds& keys, const States& from) {
  if (from.shape(0) != which.size())
    throw nb::value_error("found another number of states than there are worlds");
  Logged([&] {
    batch.LoadStates(IndicesOf(which), KeysFor(batch, keys), from.shape(1), from.data());
  });
}

using Pixels = nb::ndarray<uint8_t, nb::shape<-1, -1, 3>, nb::c_contig, nb::device::cpu>;

void Render(Batch& batch, uint32_t index, double x, double y, double scale, bool data,
            const Pixels& pixels) {
  const View view{static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), x, y,
                  scale};
  batch.With(index, [&](World& world) {
    const GilRelease no_gil;
    DrawWorld(world, view, data, pixels.data());
  });
}

std::tuple<double, double, double> Fit(Batch& batch, uint32_t index, int width, int height) {
  std::tuple<double, double, double> fitted;
  batch.With(index, [&](World& world) {
    const View view = FittedView(world, width, height);
    fitted = {view.x, view.y, view.scale};
  });
  return fitted;
}

void BindBatch(nb::module_& module) {
  nb::class_<Batch> batch(module, "Batch", "Many worlds; see stagesim.Batch.");
  batch
      .def(nb::new_(&Make), nb::arg("prototypes"), nb::arg("seeds"), nb::arg("variants"),
           nb::arg("threads"), nb::arg("robots"), nb::arg("device").none() = nb::none(),
           nb::arg("placed") = std::vector<std::string>(), nb::arg("branch") = false)
      .def_prop_ro("crowd", &Batch::crowd)
      .def_prop_ro("device_crowd", &Batch::device_crowd)
      .def_prop_ro("device", &Batch::device)
      .def_prop_ro("threads", &Batch::threads)
      .def("failures", &Batch::Failures)
      .def("reasons", &Batch::Reasons)
      .def("count_objects", &Batch::CountObjects)
      .def("set_failures", &Batch::SetFailures, nb::arg("failures"))
      .def("metrics", &Batch::MetricsOfAll)
      .def("seeds", &Batch::Seeds)
      .def("variants", &Batch::Variants)
      .def("another", &MakeAnother, nb::arg("seeds"))
      .def("render", &Render, nb::arg("index"), nb::arg("x"), nb::arg("y"), nb::arg("scale"),
           nb::arg("data"), nb::arg("to"))
      .def("fit", &Fit, nb::arg("index"), nb::arg("width"), nb::arg("height"))
      .def(
          "step",
          [](Batch& b, const Numbers& which, uint64_t steps) {
            Logged([&] { b.Step(IndicesOf(which), steps); });
          },
          nb::arg("which"), nb::arg("steps"))
      .def("rollout", &Rollout, nb::arg("moments"), nb::arg("steps"), nb::arg("commands").none(),
           nb::arg("live"), nb::arg("to"), nb::arg("recorded"),
           nb::sig("def rollout(self, moments: int, steps: int, commands: object, "
                   "live: collections.abc.Sequence[object], "
                   "to: collections.abc.Sequence[object], recorded: object) -> None"))
      .def("reset", &Reset, nb::arg("which").noconvert(), nb::arg("seeds").none().noconvert(),
           nb::arg("variants").none().noconvert(),
           nb::arg("values").none().noconvert() = nb::none())
      .def("carry_to_variants", &CarryToVariants, nb::arg("variants").noconvert(),
           nb::arg("values").noconvert())
      .def("values", &Batch::ValuesOfAll)
      .def("values_of", &Batch::ValuesOf, nb::arg("index"))
      .def(
          "restore",
          [](Batch& b, const Numbers& which, const Snapshot& from) {
            Logged([&] { b.Restore(IndicesOf(which), from); });
          },
          nb::arg("which"), nb::arg("snapshot"))
      .def(
          "reseed",
          [](Batch& b, const std::vector<uint64_t>& seeds) {
            if (seeds.size() != b.size())
              throw nb::value_error("found another number of seeds than there are worlds");
            Logged([&] { b.Reseed(seeds); });
          },
          nb::arg("seeds"))
      .def("take", &Batch::Take, nb::arg("index"))
      .def("set_prototype", &SetPrototype, nb::arg("variant"), nb::arg("prototype"),
           nb::arg("robots"), nb::arg("varied") = std::vector<std::vector<uint32_t>>(),
           nb::arg("properties") = std::vector<std::string>())
      .def("state_hashes", &Batch::StateHashes)
      .def("cast", &CastRays, nb::arg("which").noconvert(), nb::arg("poses").noconvert(),
           nb::arg("bearings"), nb::arg("range"), nb::arg("z").none(), nb::arg("robots"),
           nb::arg("ignored").noconvert(), nb::arg("ray_model"), nb::arg("to").noconvert())
      .def("find_contacts", &FindContacts, nb::arg("which").noconvert(),
           nb::arg("models").noconvert(), nb::arg("robots").noconvert(),
           nb::arg("numbers").noconvert())
      .def("count_state_words", &CountStateWords, nb::arg("which").noconvert(),
           nb::arg("keys").noconvert())
      .def("save_states", &SaveStates, nb::arg("which").noconvert(), nb::arg("keys").noconvert(),
           nb::arg("to").noconvert())
      .def("load_states", &LoadStates, nb::arg("which").noconvert(), nb::arg("keys").noconvert(),
           nb::arg("states").noconvert())
      .def("fork", &Batch::Fork, nb::arg("index"))
      .def("teleport", &Teleport, nb::arg("poses"), nb::arg("which"))
      .def("place", &Place, nb::arg("models"), nb::arg("poses"), nb::arg("which"))
      .def("find_places", &FindPlaces, nb::arg("models"), nb::arg("to"))
      .def("teleport_on_card", &TeleportOnCard, nb::arg("poses"), nb::arg("which"))
      .def("reset_on_card", &ResetOnCard, nb::arg("flags"));
  BindLog(batch);
}

void BindDeviceCrowd(nb::module_& module) {
  nb::class_<DeviceArray>(module, "DeviceArray", "An array on a device; see stagesim.DeviceArray.")
      .def_prop_ro("shape", &DeviceArray::Shape)
      .def_prop_ro("dtype", &DeviceArray::DtypeName)
      .def("dlpack", &DeviceArray::Dlpack)
      .def("dlpack_device", &DeviceArray::DlpackDevice)
      .def("numpy", &DeviceArray::Numpy)
      .def("write", &DeviceArray::Write, nb::arg("values"));
  nb::class_<DeviceCrowd>(module, "DeviceCrowd",
                          "Arrays of the robots of worlds on a device; see stagesim.Batch.")
      .def_prop_ro("size", &DeviceCrowd::size)
      .def_prop_ro("reads_cuda", &DeviceCrowd::ReadsCuda)
      .def_prop_rw("waits", &DeviceCrowd::waits, &DeviceCrowd::SetWaits)
      .def("body", &DeviceCrowd::BodyArray, nb::arg("name"))
      .def("stalled", &DeviceCrowd::StalledArray)
      .def("commands", &DeviceCrowd::CommandArray)
      .def("sensor", &DeviceCrowd::SensorArray, nb::arg("type"), nb::arg("index"), nb::arg("most"),
           nb::arg("reading"))
      .def("time", &DeviceCrowd::TimeArray)
      .def("ended", &DeviceCrowd::EndedArray);
}

}  // namespace

void BindCrowd(nb::module_& module) {
  nb::class_<Crowd>(module, "Crowd",
                    "Arrays of the robots of one or several worlds; see stagesim.Fleet.")
      .def_prop_ro("size", &Crowd::size)
      .def("body", &Crowd::BodyArray, nb::arg("name"))
      .def("stalled", &Crowd::StalledArray)
      .def("commands", &Crowd::CommandArray)
      .def("sensor", &Crowd::SensorArray, nb::arg("type"), nb::arg("index"), nb::arg("most"),
           nb::arg("reading"))
      .def("time", &Crowd::TimeArray)
      .def("ended", &Crowd::EndedArray);
  BindDeviceCrowd(module);
  BindBatch(module);
}

}  // namespace Stg::python
