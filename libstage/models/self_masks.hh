// SPDX-License-Identifier: GPL-2.0-or-later
//
// Self-masks of a tree of models in the batch of a step: they hide the tree from its own rays.

#ifndef STAGE_MODELS_SELF_MASKS_HH
#define STAGE_MODELS_SELF_MASKS_HH

#include <atomic>
#include <cstdint>

#include "messages/assert.hh"
#include "models/model.hh"
#include "sensing/scene.hh"

namespace Stg {

/// The tree's masks for the cell and the exact rasterization, each with the number of its batch.
struct Model::SelfMasks {
  struct OfRasterization {
    sensing::SelfMask mask;
    uint64_t batch = 0;

    /// Returns true for exactly one of several threads, which must make the mask for this batch.
    bool Claim(uint64_t number) {
      const std::atomic_ref<uint64_t> made_for(batch);
      return made_for.load(std::memory_order_relaxed) != number &&
             made_for.exchange(number, std::memory_order_relaxed) != number;
    }
  };
  OfRasterization of[2];
};

/// The self-masks that a model must make for its tree while several models update at once.
class Model::PendingSelfMasks {
 public:
  /// Call before adding a fan of the model. Returns the size in words of the self-mask if this
  /// model must make it, otherwise 0. If several threads run, the tree's self_masks_ must exist.
  uint32_t Reserve(const Model& model, bool exact) {
    if (!model.root->self_masks_) model.root->self_masks_ = std::make_unique<SelfMasks>();
    SelfMasks::OfRasterization& own = model.root->self_masks_->of[exact];
    if (!own.Claim(model.scene_->batch_number)) return 0;
    reserved_[exact] = true;
    own.mask = sensing::RayBatch::SelfMaskBounds(model.root->OwnRasterizations(exact));
    return own.mask.words();
  }
  /// Sets the position of the masks among the words of the batch.
  void Place(const Model& model, uint32_t first_word) const {
    for (const bool exact : {false, true}) {
      if (!reserved_[exact]) continue;
      STAGE_ASSERT(model.root->self_masks_->of[exact].batch == model.scene_->batch_number);
      sensing::SelfMask& mask = model.root->self_masks_->of[exact].mask;
      mask.first = first_word;
      first_word += mask.words();
    }
  }
  void Fill(const Model& model) const {
    sensing::Scene& scene = *model.scene_;
    const Model* tree = model.root;
    for (const bool exact : {false, true})
      if (reserved_[exact])
        scene.batch.FillSelfMask(tree->self_masks_->of[exact].mask, scene.grid,
                                 tree->OwnRasterizations(exact), tree, exact);
  }

 private:
  bool reserved_[2] = {false, false};
};

}  // namespace Stg

#endif
