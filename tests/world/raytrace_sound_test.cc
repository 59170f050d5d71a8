// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::Raytrace in the cases that Stage 4.3 gets wrong, in many places and in all directions.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "raytrace_testing.hh"
#include "stage.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

using test::RandomSource;

/// An isometry of the plane that must not change any reading: reflections, quarter turns and a
/// translation.
struct Move {
  bool mirror_x, mirror_y;
  int quarter_turns;
  double shift;

  Pose operator()(const Pose& p) const {
    double x = mirror_x ? -p.x : p.x, y = mirror_y ? -p.y : p.y;
    double a = p.a;
    if (mirror_x) a = M_PI - a;
    if (mirror_y) a = -a;
    for (int i = 0; i < quarter_turns; i++) {
      std::swap(x, y);
      x = -x;
      a += M_PI / 2;
    }
    return Pose(x + shift, y + shift, p.z, normalize(a));
  }
  /// Transforms the size of an axis-aligned box, which stays axis-aligned so that nothing is
  /// rounded.
  Size operator()(const Size& s) const { return quarter_turns % 2 ? Size(s.y, s.x, s.z) : s; }
  std::string Text() const {
    return std::string(mirror_x ? "x mirrored, " : "") + (mirror_y ? "y mirrored, " : "") +
           std::to_string(quarter_turns) + " quarter turns, shifted by " + std::to_string(shift);
  }
};

template <typename F>
void ForEachMove(F f) {
  for (const bool mirror_x : {false, true})
    for (const bool mirror_y : {false, true})
      for (int turns = 0; turns < 4; turns++)
        for (const double shift : {0.0, 20.0, -20.0, 1000.5, -1000.5}) {
          const Move move{mirror_x, mirror_y, turns, shift};
          SCOPED_TRACE(move.Text());
          f(move);
        }
}

struct Box {
  Size size;
  Pose pose;
};

/// A world of transformed boxes.
struct MovedWorld {
  std::unique_ptr<World> world = EmptyWorld();
  std::vector<Model*> models;
  Move move;
  MovedWorld(const Move& how, const std::vector<Box>& boxes) : move(how) {
    for (const Box& box : boxes) {
      Pose pose = move(box.pose);
      pose.a = 0;
      models.push_back(AddBox(world.get(), move(box.size), pose));
    }
  }
  RaytraceResult LookFrom(const Pose& from, double range) {
    Pose moved = move(from);
    moved.z = 0.5;
    return Look(world.get(), moved, range);
  }
};

// 1. Rays ended early, by up to 3 % of their range.
TEST(Unsound, RaysReachTheirRange) {
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.1, 4, 1), Pose(129.3, 100, 0, 0)}});
    for (const double range : {29.3, 30.0, 31.0}) {
      const RaytraceResult found = w.LookFrom(Pose(100, 100, 0, 0), range);
      EXPECT_EQ(found.mod, w.models[0]) << range;
      EXPECT_NEAR(found.range, 29.25, 1.5 * kCell) << range;
    }
    EXPECT_EQ(w.LookFrom(Pose(100, 100, 0, 0), 29.2).mod, nullptr);
  });
}

TEST(Unsound, FacesOneCellNearerThanTheRangeAreFound) {
  const double x = 100.1234, y = 100.4567;
  for (const double range : {0.1, 5.0, 8.0, 30.0, 80.0, 500.0})
    for (int degrees = 0; degrees < 360; degrees += (range > 100 ? 15 : 5)) {
      const double heading = dtor(degrees), distance = range - kCell;
      const std::unique_ptr<World> world = EmptyWorld();
      // A box with a face perpendicular to the ray.
      const double centre = distance + 0.05;
      Model* box = AddBox(world.get(), Size(0.1, 0.06, 1),
                          Pose(x + centre * std::cos(heading), y + centre * std::sin(heading), 0,
                               normalize(heading)));
      const RaytraceResult found = Look(world.get(), Pose(x, y, 0.5, heading), range);
      EXPECT_EQ(found.mod, box) << range << " at " << degrees;
      EXPECT_NEAR(found.range, distance, 2 * kCell) << range << " at " << degrees;
    }
}

// 2. Rays to the left or downwards skipped the border cells of the next region.
TEST(Unsound, PostsAreNotSkipped) {
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.1, 0.3, 1), Pose(13.22, 6.24, 0, 0)}});
    const double heading = dtor(-3);
    const RaytraceResult found = w.LookFrom(Pose(12.1, 6.445, 0, heading), 8);
    EXPECT_EQ(found.mod, w.models[0]);
    EXPECT_NEAR(found.range, 1.08, 2 * kCell);
  });
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.1, 0.3, 1), Pose(13.22, 6.56, 0, 0)}});
    const RaytraceResult found = w.LookFrom(Pose(12.1, 6.355, 0, dtor(3)), 8);
    EXPECT_EQ(found.mod, w.models[0]);
    EXPECT_NEAR(found.range, 1.08, 2 * kCell);
  });
}

TEST(Unsound, SweepFindsEveryPost) {
  // The ray passes well inside the post, so it must see the post at any position.
  for (const double degrees : {-3.0, 182.0, 3.0, 178.0, 87.0, 93.0, -87.0, -93.0}) {
    const std::unique_ptr<World> world = EmptyWorld();
    Model* post = AddBox(world.get(), Size(0.1, 0.1, 1), Pose());
    const double heading = dtor(degrees);
    for (const double start : {12.1, -12.1, 0.3}) {
      int missed = 0;
      for (int i = 0; i < 356; i++) {
        const double distance = 0.3 + 0.02 * i + 0.0013;
        const double aside = 0.03 * ((i % 3) - 1);  // through the middle or beside it
        post->SetPose(Pose(start + distance * std::cos(heading) - aside * std::sin(heading),
                           start + distance * std::sin(heading) + aside * std::cos(heading), 0, 0));
        const RaytraceResult found = Look(world.get(), Pose(start, start, 0.5, heading), 8);
        missed += found.mod != post;
        if (found.mod) {
          EXPECT_NEAR(found.range, distance - 0.05, 2.5 * kCell);
        }
      }
      EXPECT_EQ(missed, 0) << degrees << " from " << start;
    }
  }
}

// 3. Whole regions were skipped next to the axes.
TEST(Unsound, NearWallIsOpaque) {
  ForEachMove([](const Move& move) {
    MovedWorld left(move, {{Size(0.1, 0.4, 1), Pose(-0.4, 0.3, 0, 0)},
                           {Size(0.1, 1.4, 1), Pose(-5, 0.3, 0, 0)}});
    MovedWorld right(
        move, {{Size(0.1, 0.4, 1), Pose(0.9, 5.3, 0, 0)}, {Size(0.1, 1.4, 1), Pose(5, 5.3, 0, 0)}});
    for (int mm = 0; mm < 640; mm++) {
      const double x = mm / 1000.0;
      const RaytraceResult a = left.LookFrom(Pose(x, 0.3, 0, M_PI), 8);
      ASSERT_EQ(a.mod, left.models[0]) << mm;
      ASSERT_NEAR(a.range, x + 0.35, 1.5 * kCell) << mm;
      const RaytraceResult b = right.LookFrom(Pose(-x, 5.3, 0, 0), 8);
      ASSERT_EQ(b.mod, right.models[0]) << mm;
      ASSERT_NEAR(b.range, x + 0.85, 1.5 * kCell) << mm;
    }
  });
}

TEST(Unsound, RangersSeeTheNearWall) {
  for (const int mm : {30, 31}) {
    const std::unique_ptr<World> world = LoadText(
        "model( pose [-0.4 0.3 0 0] size [0.1 0.4 1] )\n"
        "model( pose [-5 0.3 0 0] size [0.1 1.4 1] )\n"
        "ranger( name \"eye\" pose [0.0" +
        std::to_string(mm) + " 0.3 0 180] sensor( range [0 8] samples 1 ) )\n");
    auto* eye = dynamic_cast<ModelRanger*>(world->GetModel("eye"));
    ASSERT_NE(eye, nullptr);
    eye->Subscribe();
    world->Update();
    ASSERT_EQ(eye->GetSensors().at(0).ranges.size(), 1u);
    EXPECT_NEAR(eye->GetSensors()[0].ranges[0], mm / 1000.0 + 0.35, 1.5 * kCell);
  }
}

// 4. At negative coordinates, rays examined the cell beside the right one.
TEST(Unsound, NegativeCoordinatesAreCorrect) {
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.5, 0.4, 1), Pose(2, -0.21, 0, 0)}});
    const RaytraceResult found = w.LookFrom(Pose(0.5, -0.015, 0, 0), 8);
    EXPECT_EQ(found.mod, w.models[0]);
    EXPECT_NEAR(found.range, 1.25, 1.5 * kCell);
  });
}

// 5. Bodies that do not stop a ray changed its result.
TEST(Unsound, ClutterAtAnotherHeightChangesNothing) {
  RandomSource random(1);
  for (const double centre : {0.0, 300.0, -77.7}) {
    const std::unique_ptr<World> world = EmptyWorld();
    AddBox(world.get(), Size(0.1, 40, 1), Pose(centre + 9, centre, 0, 0));
    const Pose from(centre + 0.0123, centre + 0.0456, 0.5, 0);
    const auto readings = [&] {
      std::vector<RaytraceResult> results(901);
      world->Raytrace(from, 30, M_PI / 2, Any, nullptr, nullptr, true, results);
      return results;
    };
    const std::vector<RaytraceResult> before = readings();
    for (int i = 0; i < 300; i++)
      AddBox(world.get(), Size(random.Real(0, 1), random.Real(0, 1), 1),
             Pose(centre + random.Real(-1, 10), centre + random.Real(-10, 10), 50,
                  random.Real(-3, 3)));
    const std::vector<RaytraceResult> after = readings();
    for (size_t i = 0; i < before.size(); i++) {
      EXPECT_EQ(before[i].mod, after[i].mod) << i;
      EXPECT_EQ(before[i].range, after[i].range) << i;
    }
  }
}

TEST(Unsound, ShortRaysKeepTheirHeading) {
  // The ray is 15 cells long and slightly off the axis, so that it rises by one cell.
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.1, 0.1, 1), Pose(0.25, 0.08, 0, 0)}});
    EXPECT_EQ(w.LookFrom(Pose(0.0001, 0.0105, 0, dtor(4.5)), 0.3).mod, w.models[0]);
    EXPECT_EQ(w.LookFrom(Pose(0.0001, 0.0105, 0, 0), 0.3).mod, nullptr);
  });
}

// 6. Rays shorter than a cell hit nothing.
TEST(Unsound, RaysShorterThanACell) {
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(1, 1, 1), Pose(3.005, 2.005, 0, 0)}});
    for (const double range : {1e-9, 0.001, 0.01, 0.019, 0.0199}) {
      const RaytraceResult found = w.LookFrom(Pose(2.513, 2.013, 0, 0.3), range);
      EXPECT_EQ(found.mod, w.models[0]) << range;
      EXPECT_LE(found.range, range);
      // Rays into the next cell are also short.
      EXPECT_EQ(w.LookFrom(Pose(2.4998, 2.013, 0, 0), std::max(range, 0.0003)).mod, w.models[0]);
    }
  });
}

// 7. Ranges beyond 2^31 cells were wrong.
TEST(Unsound, HugeRangesAreCorrect) {
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.1, 1, 1), Pose(2.55, 0.3, 0, 0)}});
    for (const double range : {1000.0, 4.2e7, 4.3e7, 5e7, 1e12, 1e300, kInfinity}) {
      const RaytraceResult found = w.LookFrom(Pose(0.01, 0.31, 0, 0), range);
      EXPECT_EQ(found.mod, w.models[0]) << range;
      EXPECT_NEAR(found.range, 2.49, 1.5 * kCell) << range;
      EXPECT_EQ(w.LookFrom(Pose(0.01, 0.31, 0, 2.0), range).mod, nullptr) << range;
      EXPECT_EQ(w.LookFrom(Pose(0.01, 0.31, 0, 2.0), range).range, range);
    }
  });
}

// 8. Errors of grazing rays are inherent in a grid, but at most a cell over the sine of the angle.
TEST(Unsound, GrazingIsOffByCellsOverTheSine) {
  const std::unique_ptr<World> world = EmptyWorld();
  Model* wall = AddBox(world.get(), Size(200, 1, 1), Pose(0, 10.5, 0, 0));
  for (const double degrees : {2.0, 5.0, 10.0, 30.0, 89.0, 178.0}) {
    const double heading = dtor(degrees), distance = 2 / std::sin(heading);
    const RaytraceResult found = Look(world.get(), Pose(0, 8, 0.5, heading), 80);
    EXPECT_EQ(found.mod, wall);
    EXPECT_NEAR(found.range, distance, 1.5 * kCell / std::sin(heading)) << degrees;
  }
}

// Rays along the outermost occupied cells, at the border of a region, hit them.
TEST(OddRays, AlongTheOutermostCells) {
  ForEachMove([](const Move& move) {
    for (const double size : {0.28, 1.28 * 3}) {
      // Its last column is cell 63, the last one of a region.
      MovedWorld w(move, {{Size(size, 0.1, 1), Pose(1.275 - size / 2, 0.6, 0, 0)}});
      const RaytraceResult found = w.LookFrom(Pose(1.27, 0.31, 0, M_PI / 2), 8);
      EXPECT_EQ(found.mod, w.models[0]);
      EXPECT_NEAR(found.range, 0.25, 1.5 * kCell);
    }
  });
}

}  // namespace
}  // namespace Stg
