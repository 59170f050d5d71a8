// SPDX-License-Identifier: GPL-2.0-or-later
//
// The windows of a tree of models in the batch of a step: what hides its body from its own rays.

#ifndef STAGE_MODELS_OWN_WINDOWS_HH
#define STAGE_MODELS_OWN_WINDOWS_HH

#include <atomic>
#include <cstdint>

#include "models/model.hh"
#include "sensing/scene.hh"

namespace Stg {

/// One for each drawing of the bodies; each for the batch with its number.
struct Model::OwnWindows {
  struct OfDrawing {
    sensing::Window window;
    uint64_t batch = 0;

    /// True for the one caller, of several threads, that is to make the window for this batch.
    bool Claim(uint64_t number) {
      const std::atomic_ref<uint64_t> made_for(batch);
      return made_for.load(std::memory_order_relaxed) != number &&
             made_for.exchange(number, std::memory_order_relaxed) != number;
    }
  };
  OfDrawing of[2];
};

/// Those windows of its tree that one of several models, which update at once, is to make.
class Model::WindowsToMake {
 public:
  /// Before a fan of the model: the words of its window, if that falls to the model; else 0. The
  /// tree's windows have to be there if several threads are at work.
  uint32_t Plan(const Model& model, bool exact) {
    if (!model.root->windows_) model.root->windows_ = std::make_unique<OwnWindows>();
    OwnWindows::OfDrawing& own = model.root->windows_->of[exact];
    if (!own.Claim(model.scene_->batch_number)) return 0;
    planned_[exact] = true;
    own.window = sensing::RayBatch::PlanWindow(model.root->OwnDrawings(exact));
    return own.window.words();
  }
  /// They begin here, among the words of the batch.
  void Place(const Model& model, uint32_t first_word) const {
    for (const bool exact : {false, true}) {
      if (!planned_[exact]) continue;
      sensing::Window& window = model.root->windows_->of[exact].window;
      window.first = first_word;
      first_word += window.words();
    }
  }
  void Fill(const Model& model) const {
    sensing::Scene& scene = *model.scene_;
    const Model* tree = model.root;
    for (const bool exact : {false, true})
      if (planned_[exact])
        scene.batch.FillWindow(tree->windows_->of[exact].window, scene.grid,
                               tree->OwnDrawings(exact), tree, exact);
  }

 private:
  bool planned_[2] = {false, false};
};

}  // namespace Stg

#endif
