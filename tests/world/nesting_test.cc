// SPDX-License-Identifier: GPL-2.0-or-later
//
// Very deep trees of models.

#include <algorithm>
#include <string>

#include "support/model_testing.hh"

namespace Stg {
namespace {

const int kMany = 100000;

size_t LinesOf(const std::string& text) {
  return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Makes a chain of models of maximum depth; returns the last one.
Model* MakeChain(World* world) {
  Model* last = world->CreateModel(nullptr, "model");
  while (last->Depth() < Model::kMaxDepth) last = world->CreateModel(last, "model");
  return last;
}

/// Calls all functions that traverse trees.
void UseAll(World* world, Model* last) {
  last->GetGlobalPose();
  last->Root()->SetPose(Pose(1, 1, 0, 0));
  last->Root()->HasCollision();
  last->Root()->GetTotalMass();
  last->Root()->GetUnsubscribedModelOfType("ranger");
  last->Root()->ForEachDescendant([](Model*, void*) { return 0; }, nullptr);
  OutputOf([&] { last->Root()->Print(nullptr); });
  world->CreateModel(last->Parent(), "ranger")->Subscribe();
  Step(*world, 2);
  world->StateHash();
}

TEST(Nesting, WorksUpToTheLimit) {
  const auto world = EmptyWorld();
  Model* last = MakeChain(world.get());
  UseAll(world.get(), last);
  EXPECT_EQ(world->GetAllModels().size(), Model::kMaxDepth + 3u);
  delete last->Root();
  EXPECT_EQ(world->GetAllModels().size(), 1u);
}

TEST(Nesting, CreateModelMakesNoModelBelowTheLimit) {
  const auto world = EmptyWorld();
  Model* last = MakeChain(world.get());
  const std::string errors =
      ErrorsOf([&] { EXPECT_EQ(world->CreateModel(last, "position"), nullptr); });
  EXPECT_EQ(LinesOf(errors), 1u);
  EXPECT_NE(errors.find("nested more than 1000 deep"), std::string::npos) << errors;
}

TEST(Nesting, ExplicitModelBelowTheLimitGoesToTopLevel) {
  const auto world = EmptyWorld();
  Model* last = MakeChain(world.get());
  Model* model = nullptr;
  EXPECT_EQ(LinesOf(ErrorsOf([&] { model = new Model(world.get(), last); })), 1u);
  EXPECT_EQ(model->Parent(), nullptr);
  EXPECT_EQ(model->Root(), model);
  EXPECT_TRUE(model->IsMovable());
}

TEST(Nesting, OfAHundredThousandModels) {
  const auto world = EmptyWorld();
  Model* above = nullptr;
  ErrorsOf([&] {
    for (int i = 0; i < kMany; i++) above = new Model(world.get(), above, "model", "m");
  });
  EXPECT_EQ(world->GetAllModels().size(), kMany + 1u);
  UseAll(world.get(), above);
}

TEST(Nesting, SetParentRefusesDepthsBeyondTheLimit) {
  const auto world = EmptyWorld();
  Model *last = MakeChain(world.get()), *other = MakeChain(world.get())->Root();
  for (const bool adopt : {false, true}) {
    const std::string errors = ErrorsOf([&] {
      if (adopt)
        last->BecomeParentOf(other);
      else
        EXPECT_EQ(other->SetParent(last), 1);
    });
    EXPECT_EQ(LinesOf(errors), 1u) << errors;
    EXPECT_EQ(other->Parent(), nullptr);
  }
  // A depth below the limit is allowed.
  Model* small = world->CreateModel(nullptr, "model");
  EXPECT_EQ(small->SetParent(last->Parent()), 0);
}

}  // namespace
}  // namespace Stg
