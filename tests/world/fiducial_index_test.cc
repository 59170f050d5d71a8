// SPDX-License-Identifier: GPL-2.0-or-later
//
// The spatial index of the models that fiducial finders may see.

#include "models/types/fiducial_index.hh"

#include <cmath>
#include <limits>

#include "support/model_testing.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(FiducialIndex, EqualsALinearSearch) {
  test::RandomSource random(5);
  const auto world = EmptyWorld();
  std::vector<Model*> models;
  for (int i = 0; i < 500; i++) {
    Model* model = new Model(world.get());
    model->ClearBlocks();
    const double reach = i < 250 ? 10 : 200;
    double x = random.Real(-reach, reach), y = random.Real(-reach, reach);
    if (i % 5 == 0) x = 4.0 * random.Int(-5, 5);  // exactly on borders of strips
    if (i % 7 == 0) y = random.Int(-5, 5);
    model->SetPose(Pose(x, y, 0, 0));
    model->SetFiducialReturn(random.Int(0, 3));
    models.push_back(model);
  }
  FiducialIndex index;
  index.Refresh(models);
  for (int i = 0; i < 2000; i++) {
    const Pose own = models[static_cast<size_t>(random.Int(0, 499))]->GetPose();
    const double x = random.OneIn(2) ? own.x : random.Real(-20, 20);
    const double y = random.OneIn(2) ? own.y : random.Real(-20, 20);
    const double reach = random.OneIn(2) ? random.Int(0, 12) : random.Real(0, 300);
    std::vector<Model*> expected, found;
    for (Model* model : models)
      if (model->vis.fiducial_return != 0 && std::fabs(model->GetPose().x - x) <= reach &&
          std::fabs(model->GetPose().y - y) <= reach)
        expected.push_back(model);
    for (const uint32_t near : index.Near(x, y, reach)) found.push_back(index.target(near).model);
    ASSERT_EQ(found, expected) << x << " " << y << " " << reach;
  }
  EXPECT_FALSE(index.Near(0, 0, kInfinity).empty());
  EXPECT_TRUE(index.Near(kNaN, 0, 5).empty());
  EXPECT_TRUE(index.Near(0, kInfinity, 5).empty());
  EXPECT_TRUE(index.Near(0, 0, -1).empty());
  EXPECT_TRUE(index.Near(0, 0, kNaN).empty());
}

TEST(FiducialIndex, IsReadAtEachRefreshUnlessItIsFrozen) {
  const auto world = EmptyWorld();
  Model* model = new Model(world.get());
  model->SetFiducialReturn(1);
  const std::vector<Model*> models = {model};
  FiducialIndex index;
  index.Refresh(models);
  EXPECT_EQ(index.Near(0, 0, 1).size(), 1u);
  model->SetPose(Pose(5, 0, 0, 0));
  EXPECT_EQ(index.Near(0, 0, 1).size(), 1u);
  index.Refresh(models);
  EXPECT_TRUE(index.Near(0, 0, 1).empty());
  EXPECT_EQ(index.Near(5, 0, 1).size(), 1u);

  index.SetFrozen(true);
  model->SetPose(Pose(8, 0, 0, 0));
  index.Refresh(models);  // the first one reads all models
  EXPECT_EQ(index.Near(8, 0, 1).size(), 1u);
  model->SetPose(Pose(5, 0, 0, 0));
  index.Refresh(models);
  EXPECT_EQ(index.Near(8, 0, 1).size(), 1u);
  index.Forget(nullptr);  // a deletion rebuilds the index
  index.Refresh(models);
  EXPECT_EQ(index.Near(5, 0, 1).size(), 1u);
  model->SetFiducialReturn(0);
  index.Refresh(models);
  EXPECT_EQ(index.Near(5, 0, 1).size(), 1u);
  index.SetFrozen(false);
  index.Refresh(models);
  EXPECT_TRUE(index.Near(5, 0, 1).empty());
}

/// Targets that only turn are not sorted again, but their poses are the present ones.
TEST(FiducialIndex, HasThePresentHeadings) {
  const auto world = EmptyWorld();
  Model* model = new Model(world.get());
  model->SetFiducialReturn(1);
  FiducialIndex index;
  for (const double heading : {0.0, 1.0, -2.0}) {
    model->SetPose(Pose(1, 2, 0, heading));
    index.Refresh({model});
    EXPECT_EQ(index.target(index.Near(1, 2, 0)[0]).pose.a, heading);
  }
}

}  // namespace
}  // namespace Stg
