// SPDX-License-Identifier: GPL-2.0-or-later
//
// Copies of worlds, which share unchanged data.

#include "world/world_image.hh"

#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// Erases a model's bodies; if `exact`, only those that a copy rasterizes for exact rays on demand.
void Erase(const Model& model, bool exact, grid::Grid* grid) {
  model.body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& cells) {
    if (exact && !grid->body(id).exact()) return;
    grid->Rasterize(id, cells, {});
    grid->RemoveBody(id);
  });
}

}  // namespace

/// The image is made once.
std::shared_ptr<const WorldImage> World::Image() const {
  if (!wf || engine_->loads > 0) {
    messages::Report(LogLevel::kError, "stage: found no loaded world to be copied");
    return nullptr;
  }
  const std::lock_guard<std::mutex> lock(engine_->image_mutex);
  if (!engine_->image) engine_->image = MakeImage();
  return engine_->image;
}

std::shared_ptr<const WorldImage> World::MakeImage() const {
  std::shared_ptr<WorldImage> image(new WorldImage{path_,
                                                   wf->Copy(),
                                                   engine_->outlines_of_pictures,
                                                   engine_->samples_of_pictures,
                                                   engine_->populations,
                                                   engine_->scene.grid,
                                                   {},
                                                   engine_->last_stamp_of_loading,
                                                   engine_->extent_of_loading});
  image->rasterizations.resize(static_cast<size_t>(wf->GetEntityCount()));
  for (const Model* model : engine_->models) {
    const bool stays = model->wf_entity > 0 && model->body().is_as_loaded();
    Erase(*model, stays, &image->grid);
    if (!stays) continue;
    image->rasterizations[static_cast<size_t>(model->wf_entity)] = model->body().Rasterizations();
  }
  image->grid.Freeze();
  return image;
}

/// Rasterizes the models of a copy like those of the image. All models must exist and none be
/// rasterized. Models that have moved in the original return to their place in the file and in the
/// body order.
void World::RasterizeFromImage(const WorldImage& image) {
  grid::Grid& grid = engine_->scene.grid;
  STAGE_ASSERT(grid.rasterized_cells() == 0);
  grid.AssignCopy(image.grid);
  grid.SetExtent(image.extent_of_loading);
  for (Model* model : engine_->models) {
    if (model->wf_entity <= 0) continue;
    STAGE_ASSERT(static_cast<size_t>(model->wf_entity) < image.rasterizations.size());
    const auto& rasterizations = image.rasterizations[static_cast<size_t>(model->wf_entity)];
    if (!rasterizations.empty()) model->blockgroup->AdoptRasterizations(rasterizations);
  }
  for (Model* child : children) child->Map();
  if (!wf->populations().empty()) {  // another seed places the members elsewhere
    grid.SetExtent(grid::CellBox());
    for (const Model* model : engine_->models)
      model->body().ForEachBody(
          [&](grid::BodyId, const std::vector<grid::CellSet>& cells) { grid.WidenExtent(cells); });
  }
  MarkAllRasterizedSince(image.last_stamp_of_loading);
}

}  // namespace Stg
