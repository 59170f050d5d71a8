// SPDX-License-Identifier: GPL-2.0-or-later
//
// Models: energy, trails, and what windows show.

#include <algorithm>
#include <utility>

#include "messages/assert.hh"
#include "models/body.hh"
#include "models/flag.hh"
#include "models/power_pack.hh"
#include "sensing/scene.hh"

namespace Stg {

const usec_t Model::kEnergyInterval;

// ---- energy -------------------------------------------------------------------------------------

PowerPack* Model::FindPowerPack() const {
  for (const Model* model = this; model; model = model->parent)
    if (model->power_pack) return model->power_pack.get();
  return nullptr;
}

void Model::UpdateCharge() {
  PowerPack* pack = FindPowerPack();
  if (!pack) return;  // the model had one when it started, but has another parent now
  const double seconds = static_cast<double>(kEnergyInterval) / 1e6;
  if (watts > 0) pack->Dissipate(watts * seconds, GetGlobalPose());
  if (!(watts_give > 0)) return;

  StopCharging();
  static thread_local std::vector<Model*> touching;  // static to reuse its memory
  touching.clear();
  AppendTouchingModels(&touching);
  for (Model* taker : touching) {
    PowerPack* receiver = taker->watts_take > 0 ? taker->FindPowerPack() : nullptr;
    if (!receiver) continue;
    receiver->ChargeStart();
    pack->TransferTo(receiver, std::min(watts_give, taker->watts_take) * seconds);
    charging_.push_back({receiver->ShareCharging(), receiver->model().GetId()});
  }
}

void Model::StopCharging() {
  for (const Charged& charged : charging_) *charged.charging = false;
  charging_.clear();
}

void Model::AppendTouchingModels(std::vector<Model*>* touching) const {
  const auto begin = static_cast<std::ptrdiff_t>(touching->size());
  const grid::Grid& grid = scene_->grid;
  // Bodies in a crowd share many cells, so each body is examined only once.
  static thread_local std::vector<uint64_t> last_look;  // last value of `look`, by body
  static thread_local uint64_t look = 0;
  look++;
  if (last_look.size() < grid.body_count()) last_look.resize(grid.body_count());
  static thread_local grid::Rasterizations rasterizations;  // static to reuse its memory
  rasterizations.of_bodies.clear();
  blockgroup->AppendRasterizations(&rasterizations, false);
  rasterizations.ForEachCell([&](grid::CellRef cell) {
    grid.AnyIn(cell, [&](grid::BodyId other) {
      STAGE_ASSERT(other < last_look.size() && !grid.body(other).exact());
      if (std::exchange(last_look[other], look) == look) return false;
      const grid::Body& body = grid.body(other);
      if (!IsRelated(body.model)) touching->push_back(body.model);
      return false;
    });
  });
  std::sort(touching->begin() + begin, touching->end(),
            [](const Model* a, const Model* b) { return a->id < b->id; });
  touching->erase(std::unique(touching->begin() + begin, touching->end()), touching->end());
}

// ---- trails -------------------------------------------------------------------------------------

void Model::UpdateTrail() {
  if (trail_length == 0) return;
  const TrailItem item(world_base_->SimTimeNow(), GetGlobalPose(), color);
  if (trail.size() < trail_length) {
    trail.push_back(item);
    return;
  }
  STAGE_ASSERT(trail_index < trail.size());
  trail[trail_index] = item;
  trail_index = (trail_index + 1) % trail_length;
}

std::vector<Model::TrailItem> Model::Trail() const {
  std::vector<TrailItem> items(trail);
  std::rotate(items.begin(), items.begin() + trail_index, items.end());
  return items;
}

// ---- windows ------------------------------------------------------------------------------------

void Model::AddVisualizer(Visualizer* custom_visual, bool on_by_default) {
  if (!custom_visual || !world_base_->IsGUI()) return;
  cv_list.push_back(custom_visual);
  world_base_->OfferVisualizer(custom_visual, on_by_default);
}

void Model::RemoveVisualizer(Visualizer* custom_visual) { std::erase(cv_list, custom_visual); }

void Model::RegisterOption(Option* option) { world_base_->RegisterOption(option); }
void Model::NeedRedraw() { world_base_->NeedRedraw(); }
void Model::Redraw() { world_base_->Redraw(); }
void Model::PushColor(Color col) { world_base_->PushColor(col); }
void Model::PushColor(double r, double g, double b, double a) {
  world_base_->PushColor(r, g, b, a);
}
void Model::PopColor() { world_base_->PopColor(); }

}  // namespace Stg
