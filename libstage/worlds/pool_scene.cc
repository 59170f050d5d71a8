// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/pool_scene.hh"

#include <algorithm>
#include <utility>

#include "messages/report.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"
#include "world/world_handle.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

// ---- subscriptions ------------------------------------------------------------------------------

Subscriptions::~Subscriptions() {
  for (Child* child = children_; child;) delete std::exchange(child, child->next);
}

bool Subscriptions::Has(uint32_t model) const {
  return std::ranges::find(models_, model) != models_.end();
}

Subscriptions* Subscriptions::Find(uint32_t model) const {
  for (const Child* child = children_.load(std::memory_order_acquire); child; child = child->next)
    if (child->model == model) return child->with;
  return nullptr;
}

Subscriptions* Subscriptions::With(uint32_t model) {
  if (Subscriptions* const known = Find(model)) return known;
  const std::lock_guard lock(source_.mutex_);
  if (Subscriptions* const known = Find(model)) return known;
  std::vector<uint32_t> models = models_;
  models.push_back(model);
  Child* const child = new Child{model, source_.Add(std::move(models)), children_};
  children_.store(child, std::memory_order_release);
  return child->with;
}

const std::string& Subscriptions::reason() {
  scene();
  return reason_;
}

void Subscriptions::MakeScene() {
  reason_ = "there are too many combinations of subscriptions";
  number_ = source_.scenes_++;
  if (number_ >= kMost) return;
  try {
    std::unique_ptr<World> world = source_.Make();
    for (const uint32_t id : models_)
      if (Model* const model = world->FindModel(id)) model->Subscribe();
    const std::string& changing = source_.pool_options().changing_map;
    if (changing.empty()) {
      scene_ = RowBridge::MakeScene(std::move(world), &reason_, source_.varied());
      return;
    }
    map_ = rows::ChangingMap::Make(std::move(world), changing, &reason_, source_.varied());
    if (map_) scene_ = map_->scene();
  } catch (const WorldFailure& failure) {
    reason_ = failure.why;
  }
}

// ---- the scene ----------------------------------------------------------------------------------

PoolScene::PoolScene(const World& prototype, const WorldPoolOptions& options,
                     std::vector<rows::VariedNumber> varied)
    : source_(prototype, options.device),
      pool_options_(options),
      varied_(std::move(varied)),
      options_(source_.options()),
      loaded_(Add({})) {
  if (!options.branch) return;
  options_.branch = true;
  options_.duration = 0;
  options_.clock = false;
}

std::unique_ptr<World> PoolScene::Make(uint64_t seed) const {
  RunOptions options = options_;
  options.seed = seed;
  const messages::ErrorTrap errors;
  std::unique_ptr<World> world = IsReady() ? source_.Make(options) : nullptr;
  if (!world) throw WorldFailure{errors.Last("the world can't be copied")};
  world->SetQuitTime(0);
  NotePlaced(world.get());
  return world;
}

/// Marks the models that the pool places.
void PoolScene::NotePlaced(World* world) const {
  const std::vector<std::string>& names = pool_options_.placed;
  if (names.empty()) return;
  for (const Model* model : world->engine().models)
    if (!model->Parent() && std::ranges::find(names, model->TokenStr()) != names.end())
      world->engine().placed.push_back(model->GetId());
}

std::unique_ptr<World> PoolScene::Borrow() {
  {
    const std::lock_guard lock(lending_);
    if (!spares_.empty()) {
      std::unique_ptr<World> world = std::move(spares_.back());
      spares_.pop_back();
      return world;
    }
  }
  return Make();
}

void PoolScene::GiveBack(std::unique_ptr<World> world) {
  const std::lock_guard lock(lending_);
  spares_.push_back(std::move(world));
}

const InitialState* PoolScene::initial_state() {
  std::call_once(initial_state_once_, [this] {
    const std::unique_ptr<World> world = Make();
    const WorldHandle handle(world.get());
    initial_state_ = world->CaptureInitialState();
  });
  return initial_state_.get();
}

Subscriptions* PoolScene::Add(std::vector<uint32_t> models) {
  all_.push_back(std::make_unique<Subscriptions>(this, std::move(models)));
  return all_.back().get();
}

std::string PoolScene::WhyNoRows() { return IsReady() ? loaded()->reason() : "no world is loaded"; }

bool PoolScene::IsRunningAfterLoading(uint32_t model) {
  return std::ranges::any_of(loaded()->scene()->rates, [&](const rows::RateGroup& group) {
    return std::ranges::find(group.models, model, &Model::GetId) != group.models.end();
  });
}

uint64_t PoolScene::HashOfFiles() {
  std::call_once(hash_once_, [this] {
    const Worldfile* const file = loaded()->scene()->prototype->GetWorldFile();
    for (const Worldfile::Text& each : file->Texts())
      hash_of_files_ = Fnv1a(each.text.data(), each.text.size(), hash_of_files_);
  });
  return hash_of_files_;
}

Subscriptions* PoolScene::SubscriptionsOf(const World& world) {
  if (!has_rows() || !RowBridge::WhyNotClosed(world).empty()) return nullptr;
  Subscriptions* found = loaded();
  for (const uint32_t id : RowBridge::RunningModels(world)) {
    const Model* const after_loading = loaded()->scene()->prototype->FindModel(id);
    const unsigned before = after_loading ? after_loading->GetSubscriptionCount() : 0;
    const unsigned now = world.FindModel(id)->GetSubscriptionCount();
    if (now > before + Subscriptions::kMost) return nullptr;
    for (unsigned i = before; i < now; i++) found = found->With(id);
  }
  return found;
}

}  // namespace Stg
