// SPDX-License-Identifier: GPL-2.0-or-later
//
// Bumpers, fiducial finders and blobfinders on the way between worlds and rows.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "models/blobfinder.hh"
#include "models/body.hh"
#include "models/bumper.hh"
#include "models/fiducial.hh"
#include "rows/in_mover.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "rows/shown.hh"
#include "world/engine.hh"

namespace Stg {

namespace grid = internal::grid;

namespace {

/// Finders never look at models of their own tree, which are not asked.
bool StopsAtAnything(Model*, const Model*, const void*) { return true; }
bool StopsAtBlobs(Model* candidate, const Model*, const void*) {
  return candidate->vis.blob_return;
}

double ReachOf(const Model& model) {
  if (rows::IsOfType(model, "fiducial"))
    return static_cast<const ModelFiducial&>(model).max_range_anon;
  if (rows::IsOfType(model, "blobfinder")) return static_cast<const ModelBlobfinder&>(model).range;
  const auto& bumper = static_cast<const ModelBumper&>(model);
  double reach = 0;
  for (uint32_t i = 0; i < bumper.bumper_count; i++)
    reach = std::max(reach, bumper.bumpers[i].length);
  return reach;
}

}  // namespace

/// Says why rows cannot hold a running bumper, fiducial finder or blobfinder.
std::string RowBridge::WhyNotFinder(const Model& model) {
  constexpr unsigned kMaxWidth = 1000;  // pixels
  if (!(ReachOf(model) * model.host().scene.cells_per_metre <= RAY_LEG_CELLS))
    return rows::Named(model) + " has rays of more than " + std::to_string(RAY_LEG_CELLS) +
           " cells";
  if (rows::IsOfType(model, "blobfinder") &&
      static_cast<const ModelBlobfinder&>(model).scan_width > kMaxWidth)
    return rows::Named(model) + " has more than " + std::to_string(kMaxWidth) + " pixels";
  return "";
}

// ---- the scene ----------------------------------------------------------------------------------

/// Adds the finders of all movers. Their layers, maps and others follow in FinishFinders().
class RowBridge::FinderMaker {
 public:
  FinderMaker(const World& world, rows::Scene* scene)
      : world_(world), scene_(*scene), finders_(scene->finders) {}

  void Add(Model* model, rows::InMover at);
  void FindTargets(const std::map<const Model*, rows::InMover>& places);

 private:
  rows::Finder FinderOf(const Model& model, rows::InMover at, double reach, RayModel rays) const;
  void AddBumper(const ModelBumper& bumper, rows::InMover at);

  const World& world_;
  rows::Scene& scene_;
  rows::Finders& finders_;
};

rows::Finder RowBridge::FinderMaker::FinderOf(const Model& model, rows::InMover at, double reach,
                                              RayModel rays) const {
  rows::Finder finder{};
  finder.mover = at.mover;
  finder.node = at.node;
  finder.rate = scene_.RateOf(model);
  const Pose place = model.GetGlobalPose() + model.geom.pose;
  sensing::PlaceFan(&finder.fan, Pose(0, 0, place.z, 0), reach > 0 ? reach : 0,
                    scene_.cells_per_metre);
  finder.fan.exact = world_.engine_->IsExact(rays);
  finder.fan.predicate = StopsAtAnything;
  scene_.exact = scene_.exact || finder.fan.exact;
  return finder;
}

void RowBridge::FinderMaker::Add(Model* model, rows::InMover at) {
  if (rows::IsOfType(*model, "bumper")) AddBumper(static_cast<const ModelBumper&>(*model), at);
  if (rows::IsOfType(*model, "fiducial")) {
    auto* const fiducial = static_cast<ModelFiducial*>(model);
    finders_.fiducial_finders.push_back(
        {FinderOf(*model, at, fiducial->max_range_anon, RayModel::kDefault), fiducial, {}, 0});
  }
  if (rows::IsOfType(*model, "blobfinder")) {
    const auto& blobfinder = static_cast<const ModelBlobfinder&>(*model);
    rows::Blobfinder of{};
    of.finder = FinderOf(*model, at, blobfinder.range, RayModel::kDefault);
    of.finder.fan.predicate = StopsAtBlobs;
    of.finder.fan.z_test = false;
    of.model = &blobfinder;
    of.fov = std::isfinite(blobfinder.fov) ? blobfinder.fov : 0.0;
    of.rays = blobfinder.scan_width;
    of.first_direction = scene_.directions.Find(of.fov, of.rays);
    of.first_blob = finders_.blob_count;
    finders_.blob_count += of.max_blobs();
    finders_.blobfinders.push_back(std::move(of));
  }
}

void RowBridge::FinderMaker::AddBumper(const ModelBumper& bumper, rows::InMover at) {
  for (uint32_t i = 0; i < bumper.bumper_count; i++) {
    rows::Finder finder = FinderOf(bumper, at, bumper.bumpers[i].length, RayModel::kCell);
    finder.fan.z_test = false;
    finders_.bumper_lines.push_back({std::move(finder), &bumper, i});
  }
}

/// Finds the models that fiducial finders may see.
void RowBridge::FinderMaker::FindTargets(const std::map<const Model*, rows::InMover>& places) {
  for (rows::FiducialFinder& finder : finders_.fiducial_finders) {
    finder.first_target = finders_.target_count;
    for (Model* model : world_.engine_->models) {
      if (model->vis.fiducial_return == 0 || model->IsRelated(finder.model) ||
          model->vis.fiducial_key != finder.model->vis.fiducial_key)
        continue;
      const auto place = places.find(model);
      const rows::InMover at =
          place == places.end() ? rows::InMover{rows::FiducialTarget::kStands, 0} : place->second;
      finder.targets.push_back({model, at.mover, at.node, model->GetGlobalPose()});
    }
    finders_.target_count += static_cast<uint32_t>(finder.targets.size());
  }
}

void RowBridge::AddFinders(World* prototype, rows::Scene* scene) {
  FinderMaker maker(*prototype, scene);
  std::map<const Model*, rows::InMover> places;
  rows::ForEachInMovers(*prototype, *scene, [&](Model* model, rows::InMover at) {
    places[model] = at;
    if (rows::IsRunning(*model)) maker.Add(model, at);
  });
  maker.FindTargets(places);
  const rows::Finders& finders = scene->finders;
  scene->finders.any = !finders.bumper_lines.empty() || !finders.fiducial_finders.empty() ||
                       !finders.blobfinders.empty();
}

/// Finds what the rays of finders may hit in the finished scene. Returns false if a map is too
/// large.
bool RowBridge::FinishFinders(World* prototype, rows::Scene* scene) {
  scene->finders.ForEach([&](rows::Finder& finder) {
    finder.fan.layer = scene->grid.EverythingLayer(finder.fan.exact);
    for (uint32_t k = 0; k < scene->bodies.size(); k++) {
      const rows::Body& body = scene->bodies[k];
      if (body.mover != finder.mover && rows::Stops(finder.fan, body.height, *body.model))
        finder.others.push_back(k);
    }
  });
  const ContactPhase& contacts = prototype->engine_->contacts;
  scene->finders.row_models.assign(contacts.roots().begin(), contacts.roots().end());
  scene->finders.wall_models.assign(contacts.wall_models().begin(), contacts.wall_models().end());
  return MakeFinderMaps(*prototype, scene);
}

/// Makes the maps of what stands for finders. Those that see the same share one.
bool RowBridge::MakeFinderMaps(const World& prototype, rows::Scene* scene) {
  const WorldEngine& engine = *prototype.engine_;
  std::map<std::pair<double, int>, uint32_t> known;  // by height, and by what finders see
  bool fits = true;
  scene->finders.ForEach([&](rows::Finder& finder) {
    const sensing::Fan& fan = finder.fan;
    const int kind = fan.predicate == StopsAtBlobs ? 2 : fan.z_test;
    const auto [place, is_new] =
        known.try_emplace({fan.z_test ? fan.z : 0, kind}, scene->seen.size());
    finder.seen = place->second;
    if (!is_new) return;
    std::vector<grid::CellSet> all;
    for (const Model* model : engine.models) {
      if (rows::IsOfMover(*model)) continue;
      model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& cells) {
        const grid::Body& body = engine.scene.grid.body(id);
        if (rows::Stops(fan, Bounds(body.z_min, body.z_max), *model))
          all.insert(all.end(), cells.begin(), cells.end());
      });
    }
    scene->seen.emplace_back();
    fits = scene->seen.back().Make(all, false) && fits;
  });
  return fits;
}

// ---- from a world to a row ----------------------------------------------------------------------

void RowBridge::ReadFinders(const World& world, rows::Rows* to, size_t row) {
  const rows::Finders& finders = to->scene().finders;
  rows::Columns& c = to->columns;
  ReadBumpers(world, to, row);
  for (const rows::FiducialFinder& of : finders.fiducial_finders) {
    const auto& finder = static_cast<ModelFiducial&>(*world.FindModel(of.model->GetId()));
    for (size_t i = 0; i < of.targets.size(); i++) {
      const auto seen = std::ranges::find_if(finder.fiducials_, [&](const auto& fiducial) {
        return fiducial.mod->GetId() == of.targets[i].model->GetId();
      });
      const size_t number = row * finders.target_count + of.first_target + i;
      c.found[number] = seen != finder.fiducials_.end();
      if (!c.found[number] || c.seen.empty()) continue;
      c.seen[number] = *seen;
      c.seen[number].mod = nullptr;
    }
  }
  for (size_t k = 0; k < finders.blobfinders.size(); k++) {
    const rows::Blobfinder& of = finders.blobfinders[k];
    const auto& finder = static_cast<ModelBlobfinder&>(*world.FindModel(of.model->GetId()));
    const size_t count = std::min<size_t>(finder.blobs_.size(), of.max_blobs());
    c.blobs_seen[row * finders.blobfinders.size() + k] = static_cast<uint32_t>(count);
    std::copy_n(finder.blobs_.begin(), count,
                c.blobs.data() + row * finders.blob_count + of.first_blob);
  }
}

void RowBridge::ReadBumpers(const World& world, rows::Rows* to, size_t row) {
  const std::vector<rows::BumperLine>& lines = to->scene().finders.bumper_lines;
  for (size_t k = 0; k < lines.size(); k++) {
    const auto& bumper = static_cast<ModelBumper&>(*world.FindModel(lines[k].bumper->GetId()));
    rows::Bump& bump = to->columns.bumps[row * lines.size() + k];
    bump = rows::Bump();
    if (!bumper.samples) continue;
    const ModelBumper::BumperSample& sample = bumper.samples[lines[k].index];
    bump = {sample.hit ? sample.hit->GetId() : rows::Bump::kNobody, sample.hit_point.x,
            sample.hit_point.y};
  }
}

// ---- from a row to a world ----------------------------------------------------------------------

void RowBridge::WriteFinders(const rows::Rows& from, size_t row, World* world) {
  const rows::Finders& finders = from.scene().finders;
  WriteBumpers(from, row, world);
  WriteFiducials(from, row, world);
  for (size_t k = 0; k < finders.blobfinders.size(); k++) {
    const rows::Blobfinder& of = finders.blobfinders[k];
    if (!from.HasReadings(row, of.finder.rate)) continue;
    auto& finder = static_cast<ModelBlobfinder&>(*world->FindModel(of.model->GetId()));
    const auto* const first = from.columns.blobs.data() + row * finders.blob_count + of.first_blob;
    finder.blobs_.assign(first,
                         first + from.columns.blobs_seen[row * finders.blobfinders.size() + k]);
  }
}

void RowBridge::WriteBumpers(const rows::Rows& from, size_t row, World* world) {
  const std::vector<rows::BumperLine>& lines = from.scene().finders.bumper_lines;
  for (size_t k = 0; k < lines.size(); k++) {
    if (!from.HasReadings(row, lines[k].finder.rate)) continue;
    auto& bumper = static_cast<ModelBumper&>(*world->FindModel(lines[k].bumper->GetId()));
    if (lines[k].index == 0) bumper.MakeSamples();
    bumper.samples = bumper.results_.data();
    const rows::Bump& bump = from.columns.bumps[row * lines.size() + k];
    ModelBumper::BumperSample& sample = bumper.results_[lines[k].index];
    sample.hit = bump.model == rows::Bump::kNobody ? nullptr : world->FindModel(bump.model);
    if (sample.hit) bumper.hit_ids_[lines[k].index] = bump.model;
    sample.hit_point = point_t(bump.x, bump.y);
  }
}

void RowBridge::ListFiducials(const rows::Rows& from, size_t row,
                              const rows::FiducialFinder& finder,
                              std::vector<ModelFiducial::Fiducial>* to) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  const auto pose_of = [&](uint32_t mover, uint32_t node) {
    const rows::Mover& of = scene.movers[mover];
    return of.GlobalPoseOf(node, rows::PoseOf(c.sensed[row * scene.movers.size() + mover], of.z));
  };
  const size_t first = row * scene.finders.target_count + finder.first_target;
  for (size_t i = 0; i < finder.targets.size(); i++) {
    if (!c.found[first + i]) continue;
    const rows::FiducialTarget& target = finder.targets[i];
    ModelFiducial::Fiducial seen;
    if (c.seen.empty()) {
      const bool stands = target.mover == rows::FiducialTarget::kStands;
      const Pose there = stands ? target.place : pose_of(target.mover, target.node);
      MakeCandidate(finder, pose_of(finder.finder.mover, finder.finder.node), target, there, &seen);
    } else {
      seen = c.seen[first + i];
    }
    seen.mod = target.model;
    to->push_back(seen);
  }
}

void RowBridge::WriteFiducials(const rows::Rows& from, size_t row, World* world) {
  for (const rows::FiducialFinder& of : from.scene().finders.fiducial_finders) {
    if (!from.HasReadings(row, of.finder.rate)) continue;
    auto& finder = static_cast<ModelFiducial&>(*world->FindModel(of.model->GetId()));
    finder.fiducials_.clear();
    ListFiducials(from, row, of, &finder.fiducials_);
    for (ModelFiducial::Fiducial& seen : finder.fiducials_)
      seen.mod = world->FindModel(seen.mod->GetId());
  }
}

}  // namespace Stg
