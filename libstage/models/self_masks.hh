// SPDX-License-Identifier: GPL-2.0-or-later
//
// The self-masks of a tree of models in the batch of a step: what hides its body from its own rays.

#ifndef STAGE_MODELS_SELF_MASKS_HH
#define STAGE_MODELS_SELF_MASKS_HH

#include <atomic>
#include <cstdint>

#include "models/model.hh"
#include "sensing/scene.hh"

namespace Stg {

/// One for each drawing of the bodies; each for the batch with its number.
struct Model::SelfMasks {
  struct OfDrawing {
    sensing::SelfMask mask;
    uint64_t batch = 0;

    /// True for the one caller, of several threads, that is to make the self-mask for this batch.
    bool Claim(uint64_t number) {
      const std::atomic_ref<uint64_t> made_for(batch);
      return made_for.load(std::memory_order_relaxed) != number &&
             made_for.exchange(number, std::memory_order_relaxed) != number;
    }
  };
  OfDrawing of[2];
};

/// Those self-masks of its tree that one of several models, which update at once, is to make.
class Model::SelfMasksToMake {
 public:
  /// Before a fan of the model: the words of its self-mask, if that falls to the model; else 0. The
  /// tree's self-masks have to be there if several threads are at work.
  uint32_t Plan(const Model& model, bool exact) {
    if (!model.root->self_masks_) model.root->self_masks_ = std::make_unique<SelfMasks>();
    SelfMasks::OfDrawing& own = model.root->self_masks_->of[exact];
    if (!own.Claim(model.scene_->batch_number)) return 0;
    planned_[exact] = true;
    own.mask = sensing::RayBatch::PlanSelfMask(model.root->OwnDrawings(exact));
    return own.mask.words();
  }
  /// They begin here, among the words of the batch.
  void Place(const Model& model, uint32_t first_word) const {
    for (const bool exact : {false, true}) {
      if (!planned_[exact]) continue;
      sensing::SelfMask& mask = model.root->self_masks_->of[exact].mask;
      mask.first = first_word;
      first_word += mask.words();
    }
  }
  void Fill(const Model& model) const {
    sensing::Scene& scene = *model.scene_;
    const Model* tree = model.root;
    for (const bool exact : {false, true})
      if (planned_[exact])
        scene.batch.FillSelfMask(tree->self_masks_->of[exact].mask, scene.grid,
                                 tree->OwnDrawings(exact), tree, exact);
  }

 private:
  bool planned_[2] = {false, false};
};

}  // namespace Stg

#endif
