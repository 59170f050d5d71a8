// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::StateHash() covers the common state of models of all types.

#include <gtest/gtest.h>

#include <string>

#include "support/model_testing.hh"

namespace Stg {
namespace {

class StateHashOf : public testing::TestWithParam<std::string> {};

// A type that overrides ExchangeState() must call its parent class.
TEST_P(StateHashOf, CoversThePose) {
  const auto world = EmptyWorld();
  Model* model = world->CreateModel(nullptr, GetParam());
  ASSERT_NE(model, nullptr);
  const uint64_t before = world->StateHash();
  for (const Pose& pose :
       {Pose(1, 0, 0, 0), Pose(0, 1, 0, 0), Pose(0, 0, 1, 0), Pose(0, 0, 0, 1)}) {
    model->SetPose(pose);
    EXPECT_NE(world->StateHash(), before) << pose.String();
  }
  model->SetPose(Pose());
  EXPECT_EQ(world->StateHash(), before);
}

std::vector<std::string> AllTypes() {
  InitLibrary();
  std::vector<std::string> types;
  for (const auto& [name, creator] : Model::name_map) types.push_back(name);
  return types;
}

INSTANTIATE_TEST_SUITE_P(Types, StateHashOf, testing::ValuesIn(AllTypes()),
                         [](const auto& type) { return type.param; });

}  // namespace
}  // namespace Stg
