// SPDX-License-Identifier: GPL-2.0-or-later

#include <nanobind/ndarray.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <tuple>
#include <utility>

#include "bindings.hh"
#include "crowd.hh"
#include "geometry/load_error.hh"
#include "model_handle.hh"
#include "models/host.hh"
#include "text.hh"

namespace Stg::python {

namespace {

/// Contents of picture files by name.
using Pictures = std::map<std::string, nb::bytes>;

/// Makes a world without a file. Options that are not given have their defaults.
std::shared_ptr<Simulation> Make(const nb::dict& given, const Pictures& pictures) {
  RunOptions options;
  options.listed = false;
  std::map<std::string, std::string> contents;
  for (const auto& [name, content] : pictures)
    contents.emplace(name, std::string(content.c_str(), content.size()));
  if (!contents.empty())
    options.pictures = std::make_shared<const std::map<std::string, std::string>>(contents);
  for (const RunOption& option : RunOptionTable())
    if (given.contains(option.name))
      option.set(&options, nb::cast<OptionValue>(given[option.name]));
  return std::make_shared<Simulation>(std::make_unique<World>(options));
}

std::vector<ModelHandle> ModelsOf(Simulation& simulation) {
  return simulation.With([&](World& world) {
    std::vector<ModelHandle> models;
    for (const Model* model : world.host().models)
      if (model != world.GetGround()) models.emplace_back(simulation.shared_from_this(), *model);
    return models;
  });
}

std::optional<ModelHandle> FindByName(Simulation& simulation, const std::string& name) {
  return simulation.With([&](World& world) -> std::optional<ModelHandle> {
    const Model* const found = world.host().names.Find(name, world.host());
    if (!found) return std::nullopt;
    return ModelHandle(simulation.shared_from_this(), *found);
  });
}

/// Ids of the two models of each contact, and its point, normal and gap: 2 and 5 numbers each.
std::pair<std::vector<uint32_t>, std::vector<double>> ContactsOf(Simulation& simulation) {
  return simulation.With([](World& world) {
    std::pair<std::vector<uint32_t>, std::vector<double>> all;
    world.ForEachContact([&](const ContactPoint& contact) {
      all.first.insert(all.first.end(), {contact.a->GetId(), contact.b->GetId()});
      all.second.insert(all.second.end(), {contact.point.x, contact.point.y, contact.normal.x,
                                           contact.normal.y, contact.gap});
    });
    return all;
  });
}

ModelHandle Create(Simulation& simulation, const std::string& type,
                   const std::optional<ModelHandle>& parent) {
  return Logged([&] {
    return simulation.With([&](World& world) {
      Model* above = nullptr;
      if (parent) {
        above = simulation.Find(0, parent->key());
        if (!above || parent->simulation().get() != &simulation)
          throw Failure{Kind::kGone, "the parent is gone, or is in another world"};
      }
      const ErrorCollector collector;
      Model* const made = world.CreateModel(above, type);
      if (!made)
        throw Failure{Kind::kStage,
                      collector.Last("no model of the type " + type + " can be made here")};
      return ModelHandle(simulation.shared_from_this(), *made);
    });
  });
}

void Include(Simulation& simulation, const std::string& file) {
  Logged([&] {
    simulation.With([&](World& world) {
      Worldfile* const content = world.GetWorldFile();
      if (!content) throw Failure{Kind::kStage, "found no world file, expected one"};
      try {
        content->Include(file);
      } catch (const LoadError& error) {
        throw Failure{Kind::kStage, error.what()};
      }
    });
  });
}

/// A model that drives: its id, its name, its type, and whether it stands on the ground.
using Robot = std::tuple<uint32_t, std::string, std::string, bool>;
std::vector<Robot> RobotsOf(Simulation& simulation) {
  return simulation.With([](World& world) {
    std::vector<Robot> robots;
    for (const Model* model : world.host().models)
      if (dynamic_cast<const ModelPosition*>(model))
        robots.emplace_back(model->GetId(), model->TokenStr(), model->GetModelType(),
                            model->Parent() == nullptr);
    return robots;
  });
}

std::shared_ptr<Crowd> MakeCrowd(Simulation& simulation, const std::vector<uint32_t>& ids) {
  return simulation.With([&](World& world) {
    std::vector<ModelKey> keys;
    for (const uint32_t id : ids)
      if (const Model* const model = world.FindModel(id)) keys.push_back(simulation.KeyOf(*model));
    auto crowd = std::make_shared<Crowd>(simulation.weak_from_this(),
                                         std::vector<Crowd::Robots>{keys}, 1, true);
    simulation.Register(crowd);
    return crowd;
  });
}

using Poses = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Mask = nb::ndarray<const bool, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

void Teleport(Simulation& simulation, Crowd& crowd, const Poses& poses, const Mask& which) {
  if (poses.shape(0) != crowd.size() || which.shape(0) != crowd.size())
    throw nb::value_error("found another number of poses than there are robots");
  simulation.With([&](World&) {
    crowd.Teleport(simulation, 0, poses.data(), which.data());
    simulation.Refresh();
  });
}

/// All metrics by name; NaN stands for a metric without a value.
std::vector<std::pair<std::string, double>> MetricsOf(Simulation& simulation) {
  return simulation.With([](World& world) {
    std::vector<std::pair<std::string, double>> metrics;
    for (const NamedMetric& metric : world.Metrics())
      metrics.emplace_back(metric.name, metric.value);
    return metrics;
  });
}

void SetMetric(Simulation& simulation, const std::string& name, double value) {
  simulation.With([&](World& world) { world.SetMetric(name, value); });
}

void BindRunning(nb::class_<Simulation>& world) {
  world
      .def(
          "load_file",
          [](Simulation& s, const std::string& path) { Logged([&] { s.LoadFile(path); }); },
          nb::arg("path"))
      .def(
          "load_text",
          [](Simulation& s, const std::string& text, const std::string& path) {
            Logged([&] { s.LoadText(text, path); });
          },
          nb::arg("text"), nb::arg("path"))
      .def("close", &Simulation::Close)
      .def(
          "step",
          [](Simulation& s, uint64_t steps) { return Logged([&] { return s.Step(steps); }); },
          nb::arg("steps"))
      .def(
          "reset", [](Simulation& s, uint64_t seed) { Logged([&] { s.Reset(seed); }); },
          nb::arg("seed"))
      .def(
          "take", [](Simulation& s, bool lean) { return Logged([&] { return s.Take(lean); }); },
          nb::arg("lean"))
      .def(
          "restore", [](Simulation& s, const Snapshot& from) { Logged([&] { s.Restore(from); }); },
          nb::arg("snapshot"))
      .def("fork", [](Simulation& s) { return Logged([&] { return s.Fork(); }); })
      .def("state_hash", &Simulation::StateHash);
}

void BindState(nb::class_<Simulation>& world) {
  const auto of_world = [](auto f) {
    return [f](Simulation& s) { return s.With([&](World& w) { return f(w); }); };
  };
  const auto held = [](auto f) {  // for properties that can be read after the world is gone
    return [f](Simulation& s) {
      const Source::Use use(&s);
      return f(s);
    };
  };
  world.def_prop_ro("microseconds", of_world([](World& w) { return w.SimTimeNow(); }))
      .def_prop_ro("interval", of_world([](World& w) { return w.sim_interval; }))
      .def_prop_ro("speedup", of_world([](World& w) { return w.speedup; }))
      .def_prop_ro("updates", of_world([](World& w) { return w.GetUpdateCount(); }))
      .def_prop_ro("seed", of_world([](World& w) { return w.seed(); }))
      .def_prop_ro("threads", of_world([](World& w) { return w.options().threads; }))
      .def_prop_ro("device", of_world([](World& w) { return w.statistics().device; }))
      .def_prop_ro("name", of_world([](World& w) { return w.TokenStr(); }))
      .def_prop_ro("wants_to_quit", of_world([](World& w) { return w.TestQuit(); }))
      .def_prop_ro("quit_time", held([](const Simulation& s) { return s.quit_time(); }))
      .def("cancel_quit", of_world([](World& w) { w.CancelQuit(); }))
      .def_prop_ro("is_open", held([](const Simulation& s) { return s.is_open(); }));
}

nb::bytes BytesOf(const Snapshot& snapshot) {
  std::ostringstream out;
  if (!snapshot.Write(out)) throw Failure{Kind::kStage, "the snapshot can't be written"};
  const std::string bytes = out.str();
  return nb::bytes(bytes.data(), bytes.size());
}

Snapshot SnapshotOf(const nb::bytes& bytes) {
  std::istringstream in(std::string(bytes.c_str(), bytes.size()));
  const ErrorCollector collector;
  Snapshot snapshot;
  if (!snapshot.Read(in)) throw Failure{Kind::kStage, collector.Last("this is no snapshot")};
  return snapshot;
}

void BindSnapshot(nb::module_& module) {
  nb::class_<Snapshot>(
      module, "Snapshot",
      "The state of a world at one moment. A snapshot never changes; it can be pickled, "
      "and another process can restore it.")
      .def_prop_ro(
          "time", [](const Snapshot& s) { return static_cast<double>(s.time()) / 1e6; },
          "Simulated time of the snapshot in seconds.")
      .def_prop_ro("size", &Snapshot::size, "Size of the snapshot in bytes.")
      .def_prop_ro("hash", &Snapshot::hash,
                   "A hash of the state: equal for snapshots of the same kind and state.")
      .def("to_bytes", &BytesOf,
           "Returns the snapshot as bytes, in the format of `stage --save-snapshot`.")
      .def_static(
          "from_bytes", &SnapshotOf, nb::arg("data"),
          "Reads a snapshot from the bytes of to_bytes(). Raises StageError for other data. Read "
          "only data from a source that you trust.")
      .def("__getstate__", &BytesOf)
      .def("__setstate__",
           [](Snapshot& s, const nb::bytes& bytes) { new (&s) Snapshot(SnapshotOf(bytes)); });
}

}  // namespace

void BindWorld(nb::module_& module) {
  BindSnapshot(module);
  nb::class_<Simulation> world(module, "Simulation", "A world; see stagesim.World.");
  world.def(nb::new_(&Make), nb::arg("options"), nb::arg("pictures") = Pictures());
  BindRunning(world);
  BindState(world);
  BindCast(world);
  BindField(module, world);
  BindLight(world);
  BindLog(module, world);
  BindMap(world);
  BindPicture(module, world);
  BindRadio(world);
  BindScene(module, world);
  BindSections(world);
  world
      .def("options",
           [](Simulation& simulation) {
             return simulation.With([](World& own) { return ValuesOf(own.options()); });
           })
      .def("metrics", &MetricsOf)
      .def("set_metric", &SetMetric, nb::arg("name"), nb::arg("value"))
      .def("models", &ModelsOf)
      .def("contacts", &ContactsOf)
      .def("find", &FindByName, nb::arg("name"))
      .def("create", &Create, nb::arg("type"), nb::arg("parent").none())
      .def("include", &Include, nb::arg("file"))
      .def(
          "macros",
          [](Simulation& s, const std::string& type) {
            return s.With([&](World& w) {
              const Worldfile* const file = w.GetWorldFile();
              return file ? file->MacrosOf(type) : std::vector<std::string>();
            });
          },
          nb::arg("type"))
      .def("robots", &RobotsOf)
      .def("crowd", &MakeCrowd, nb::arg("ids"))
      .def("teleport", &Teleport, nb::arg("crowd"), nb::arg("poses"), nb::arg("which"));
}

}  // namespace Stg::python
