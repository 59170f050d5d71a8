// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::Raytrace: known readings, the cases that Stage 4.3 gets wrong, and random worlds against
// the plain walk.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "geometry/trigonometry.hh"
#include "grid/outline.hh"
#include "model_testing.hh"
#include "stage.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

using test::RandomSource;

constexpr double kCell = 0.02;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

bool Any(Model*, const Model*, const void*) { return true; }

Model* AddBox(World* world, const Size& size, const Pose& pose) {
  Model* model = world->CreateModel(nullptr, "model");
  model->SetGeom(Geom(Pose(), size));
  model->SetPose(pose);
  return model;
}

RaytraceResult Look(World* world, const Pose& from, double range) {
  return world->Raytrace(from, range, Any, nullptr, nullptr, true);
}

/// How far a reading, which is the middle of the way through the cell, may be from the place where
/// another convention has it: one and a half cells along the longer axis.
double Slack(double heading) {
  return 1.5 * kCell / std::max(std::fabs(std::cos(heading)), std::fabs(std::sin(heading)));
}

// ---- known readings -----------------------------------------------------------------------------

struct KnownWorld {
  std::unique_ptr<World> world = EmptyWorld();
  std::map<char, Model*> models;
  KnownWorld() {
    models['-'] = nullptr;
    models['A'] = AddBox(world.get(), Size(1, 1, 1), Pose(3, 2, 0, 0));
    models['B'] = AddBox(world.get(), Size(1, 0.6, 1), Pose(-2.5, 1.3, 0, 0.5));
    models['C'] = AddBox(world.get(), Size(0.1, 4, 1), Pose(-5, -1, 0, 0));
    models['D'] = AddBox(world.get(), Size(0.3, 0.3, 0.2), Pose(1.2, -0.9, 0, M_PI / 4));
    models['E'] = AddBox(world.get(), Size(20, 0.1, 1), Pose(0, -8, 0, 0.05));
  }
};

struct Reading {
  double x, y, z, heading, range;
  char hit;
  double expected;
};

TEST(KnownReadings, OfStage43) {
  const KnownWorld known;
  const Reading readings[] = {
      {0.1, 0.2, 0.5, 0, 8, '-', 8},
      {0.1, 0.2, 0.5, 0.6, 8, 'A', 2.9079079548295601},
      {0.1, 0.2, 0.5, 0.75, 8, 'A', 3.2800826992133425},
      {0.1, 0.2, 0.5, 2.7, 8, 'B', 2.3449456093958401},
      {0.1, 0.2, 0.5, 3.0, 8, 'C', 5.1111498494944492},
      {0.1, 0.2, 0.5, -3.1, 8, 'C', 5.0643799275963906},
      {0.1, 0.2, 0.5, M_PI, 8, 'C', 5.0599999999999996},
      {0.1, 0.2, 0.5, -M_PI / 2, 9, 'E', 8.1600000000000001},
      {0.1, 0.2, 0.5, -0.8, 8, '-', 8},
      {0.1, 0.2, 0.1, -0.8, 8, 'D', 1.4218879757764089},
      {0.1, 0.2, 0.2, -0.8, 8, 'D', 1.4218879757764089},  // the heights just touch
      {0.1, 0.2, 0.21, -0.8, 8, '-', 8},
      {-0.015, -0.013, 0.5, -2.9, 8, 'C', 5.0929073748899869},
      {-0.015, -0.013, 0.5, 2.65, 8, 'B', 2.4331253625908591},
      {-0.015, -0.013, 0.5, 0.62, 8, 'A', 3.0901419977538711},
      {2.9, 1.9, 0.5, 1.0, 5, 'A', 0.71303706346687279},  // from inside
      {2.0, 2.0, 0.5, 0.1, 0.55, 'A', 0.50251045920022763},
      {2.505, 2.0, 0.5, 0.3, 0.021, 'A', 0},  // in the start cell
      {9.7, 6.1, 0.5, -2.2, 18.5, 'E', 17.415043447913526},
      // Stage 4.3 finds nothing here, as its rays end early.
      {2.0, 2.0, 0.5, 0.1, 0.51, 'A', 0.50251045920022763},
      {2.505, 2.0, 0.5, 0.3, 0.019, 'A', 0},
      {9.7, 6.1, 0.5, -2.2, 17.6, 'E', 17.415043447913526},
  };
  for (const Reading& r : readings) {
    const Pose from(r.x, r.y, r.z, r.heading);
    const RaytraceResult found = Look(known.world.get(), from, r.range);
    const std::string which = from.String() + " " + std::to_string(r.range);
    EXPECT_EQ(found.mod, known.models.at(r.hit)) << which;
    if (r.hit == '-')
      EXPECT_EQ(found.range, r.expected) << which;
    else
      EXPECT_NEAR(found.range, r.expected, Slack(r.heading)) << which;
    EXPECT_LE(found.range, r.range);
    EXPECT_EQ(found.pose, from);
  }
}

TEST(KnownReadings, ColoursAreThoseOfTheModelHit) {
  const KnownWorld known;
  known.models.at('A')->SetColor(Color(0.25, 0.5, 0.75, 1));
  const RaytraceResult hit = Look(known.world.get(), Pose(0.1, 0.2, 0.5, 0.6), 8);
  EXPECT_EQ(hit.color, Color(0.25, 0.5, 0.75, 1));
  const RaytraceResult miss = Look(known.world.get(), Pose(0.1, 0.2, 0.5, 0), 8);
  EXPECT_EQ(miss.color, Color(1, 0, 0, 1));
}

TEST(KnownReadings, PredicateFinderArgumentAndHeights) {
  const KnownWorld known;
  World* world = known.world.get();
  struct Asked {
    const Model* finder = nullptr;
    const Model* refused = nullptr;
  };
  static Asked asked;
  const auto predicate = [](Model* candidate, const Model* finder, const void* arg) {
    asked.finder = finder;
    return candidate != arg;
  };
  Model* a = known.models.at('A');
  Model* c = known.models.at('C');
  const Ray ray(c, Pose(3, 2, 0.5, M_PI), 20, predicate, a, true);
  EXPECT_EQ(world->Raytrace(ray).mod, nullptr);  // A is looked through, all else is lower
  EXPECT_EQ(asked.finder, c);
  EXPECT_EQ(world->Raytrace(Ray(c, Pose(3, 2, 0.5, M_PI), 20, predicate, c, true)).mod, a);
  // Without the test of heights D is seen from above.
  EXPECT_EQ(Look(world, Pose(0.1, 0.2, 5, -0.8), 8).mod, nullptr);
  EXPECT_EQ(world->Raytrace(Pose(0.1, 0.2, 5, -0.8), 8, Any, nullptr, nullptr, false).mod,
            known.models.at('D'));
}

// ---- fans ---------------------------------------------------------------------------------------

TEST(Fans, RaysAreSpreadFromRightToLeft) {
  const KnownWorld known;
  for (const double fov : {M_PI, 2 * M_PI, 1.0, 0.0, -1.0})
    for (const size_t count : {2u, 3u, 180u}) {
      std::vector<RaytraceResult> results(count);
      const Pose from(0.1, 0.2, 0.5, 0.4);
      known.world->Raytrace(from, 30, fov, Any, nullptr, nullptr, true, results);
      for (size_t i = 0; i < count; i++) {
        Pose ray = from;
        ray.a += -fov / 2 + static_cast<double>(i) * fov / static_cast<double>(count - 1);
        const RaytraceResult single = Look(known.world.get(), ray, 30);
        // The heading of a ray of a fan is rounded once more: cells may differ in rare cases.
        EXPECT_EQ(results[i].mod, single.mod) << fov << " " << i;
        EXPECT_NEAR(results[i].range, single.range, 2.1 * kCell) << fov << " " << i;
      }
    }
}

TEST(Fans, ASingleRayLooksAhead) {
  const KnownWorld known;
  for (const double fov : {0.0, 1.0, 2 * M_PI, kInfinity, kNaN}) {
    std::vector<RaytraceResult> results(1);
    const Pose from(0.1, 0.2, 0.5, 0.6);
    known.world->Raytrace(from, 8, fov, Any, nullptr, nullptr, true, results);
    EXPECT_EQ(results[0].mod, known.models.at('A'));
    EXPECT_EQ(results[0].range, Look(known.world.get(), from, 8).range);
  }
}

TEST(Fans, NoRays) {
  const KnownWorld known;
  std::vector<RaytraceResult> results;
  known.world->Raytrace(Pose(), 8, 1, Any, nullptr, nullptr, true, results);
  EXPECT_TRUE(results.empty());
}

// ---- odd arguments ------------------------------------------------------------------------------

TEST(OddRays, NothingHitGivesTheRangeItself) {
  const std::unique_ptr<World> world = EmptyWorld();
  for (const double range : {0.0, 0.001, 1.0 / 3, 8.0, 1e9, 1e300, kInfinity, -1.0}) {
    EXPECT_EQ(Look(world.get(), Pose(1, 2, 0.5, 0.7), range).range, range);
    EXPECT_EQ(Look(world.get(), Pose(1, 2, 0.5, 0.7), range).mod, nullptr);
  }
  EXPECT_TRUE(std::isnan(Look(world.get(), Pose(1, 2, 0.5, 0.7), kNaN).range));
}

TEST(OddRays, PosesThatAreNoneHitNothing) {
  const std::unique_ptr<World> world = EmptyWorld();
  AddBox(world.get(), Size(4, 4, 4), Pose());
  AddBox(world.get(), Size(0.01, 0.01, 4), Pose(0.01, 0.01, 0, 0));
  for (const double bad : {kNaN, kInfinity, -kInfinity})
    for (const Pose& from : {Pose(bad, 0, 1, 0), Pose(0, bad, 1, 0), Pose(0, 0, 1, bad)}) {
      const RaytraceResult found = Look(world.get(), from, 8);
      EXPECT_EQ(found.mod, nullptr) << from.String();
      EXPECT_EQ(found.range, 8) << from.String();
    }
}

TEST(OddRays, HugeHeadingsEnd) {
  const std::unique_ptr<World> world = EmptyWorld();
  AddBox(world.get(), Size(4, 4, 4), Pose());
  for (const double heading : {1e6, -1e9, 1e100, 1e308})
    EXPECT_NE(Look(world.get(), Pose(0, 0, 1, heading), 8).mod, nullptr) << heading;
}

// ---- what Stage 4.3 gets wrong ------------------------------------------------------------------

/// A move of the plane under which every reading should stay what it is: mirrored, turned by
/// quarter turns, shifted.
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
  /// Of a box that is parallel to the axes. It is not turned, so that no corner is rounded.
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

/// A world of boxes, moved.
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
    for (int degrees = 0; degrees<360; degrees += range> 100 ? 15 : 5) {
      const double heading = dtor(degrees), distance = range - kCell;
      const std::unique_ptr<World> world = EmptyWorld();
      // A box whose face stands across the ray.
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
TEST(Unsound, PostsAreNotStridedOver) {
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

TEST(Unsound, NoPostOfASweepIsMissed) {
  // The ray passes well within the post, wherever that stands: it has to be seen.
  for (const double degrees : {-3.0, 182.0, 3.0, 178.0, 87.0, 93.0, -87.0, -93.0}) {
    const std::unique_ptr<World> world = EmptyWorld();
    Model* post = AddBox(world.get(), Size(0.1, 0.1, 1), Pose());
    const double heading = dtor(degrees);
    for (const double start : {12.1, -12.1, 0.3}) {
      int missed = 0;
      for (int i = 0; i < 356; i++) {
        const double distance = 0.3 + 0.02 * i + 0.0013;
        const double aside = 0.03 * ((i % 3) - 1);  // in the middle, or nearer to an end
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
TEST(Unsound, NobodyLooksThroughTheNearWall) {
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

// 4. At negative coordinates rays looked into the cell beside the right one.
TEST(Unsound, NegativeCoordinatesAreLikeOthers) {
  ForEachMove([](const Move& move) {
    MovedWorld w(move, {{Size(0.5, 0.4, 1), Pose(2, -0.21, 0, 0)}});
    const RaytraceResult found = w.LookFrom(Pose(0.5, -0.015, 0, 0), 8);
    EXPECT_EQ(found.mod, w.models[0]);
    EXPECT_NEAR(found.range, 1.25, 1.5 * kCell);
  });
}

// 5. Bodies that a ray does not stop at changed it.
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
  // Three degrees off the axis and 15 cells long: the ray rises by one cell.
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
      // And into the next cell.
      EXPECT_EQ(w.LookFrom(Pose(2.4998, 2.013, 0, 0), std::max(range, 0.0003)).mod, w.models[0]);
    }
  });
}

// 7. Ranges beyond 2^31 cells.
TEST(Unsound, HugeRangesAreOrdinary) {
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

// 8. Grazing: inherent in a grid, but bounded by a cell over the sine of the angle.
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

// The outermost cells of all that is drawn, at the border of a region: rays along them are seen.
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

// ---- random worlds ------------------------------------------------------------------------------

/// The cells of a world's boxes, drawn here once more.
using Picture = std::map<std::pair<int64_t, int64_t>, std::vector<Model*>>;

void Draw(Picture* picture, Model* model) {
  const Size size = model->GetGeom().size;
  const double x = size.x / 2, y = size.y / 2;
  const std::vector<point_int_t> corners =
      model->LocalToPixels({point_t(-x, -y), point_t(x, -y), point_t(x, y), point_t(-x, y)});
  internal::grid::ForEachCellOfOutline(corners.data(), corners.size(), [&](int32_t cx, int32_t cy) {
    (*picture)[{cx, cy}].push_back(model);
  });
}

/// What the plain walk finds.
Model* Expected(const Picture& picture, const Pose& from, double range) {
  const auto fixed = [](double value) { return static_cast<int64_t>(std::floor(value * 65536)); };
  const double x = from.x * 50, y = from.y * 50;
  const SineCosine heading = SinCos(from.a);
  const auto rounded = [&](double value) {
    return static_cast<int64_t>(std::copysign(std::floor(std::fabs(value) + 0.5), value));
  };
  const test::PlainRay ray{static_cast<int64_t>(std::floor(x)),
                           static_cast<int64_t>(std::floor(y)),
                           fixed(x - std::floor(x)),
                           fixed(y - std::floor(y)),
                           rounded(heading.cosine * (range * 50) * 65536),
                           rounded(heading.sine * (range * 50) * 65536)};
  Model* hit = nullptr;
  test::WalkPlainly(ray, [&](int64_t, int64_t, int64_t cx, int64_t cy) {
    const auto found = picture.find({cx, cy});
    if (found == picture.end()) return false;
    hit = *std::min_element(found->second.begin(), found->second.end(),
                            [](Model* a, Model* b) { return a->GetId() < b->GetId(); });
    return true;
  });
  return hit;
}

TEST(RandomWorlds, EveryRayHitsWhatThePlainWalkFinds) {
  RandomSource random(2);
  int hits = 0;
  for (const double centre : {0.0, 50.0, -50.0, 1e6}) {
    const std::unique_ptr<World> world = EmptyWorld();
    Picture picture;
    for (int i = 0; i < 60; i++) {
      Model* box = AddBox(world.get(), Size(random.Real(0.03, 3), random.Real(0.03, 3), 1),
                          Pose(centre + random.Real(-15, 15), centre + random.Real(-15, 15), 0,
                               random.Real(-3, 3)));
      Draw(&picture, box);
    }
    for (int i = 0; i < 8000; i++) {
      const Pose from(centre + random.Real(-20, 20), centre + random.Real(-20, 20), 0.5,
                      random.OneIn(10) ? random.Int(-2, 2) * M_PI / 2 : random.Real(-3, 3));
      const double range = random.Real(0.01, 30);
      const RaytraceResult found = Look(world.get(), from, range);
      ASSERT_EQ(found.mod, Expected(picture, from, range)) << from.String() << " " << range;
      if (!found.mod) {
        ASSERT_EQ(found.range, range);
        continue;
      }
      hits++;
      ASSERT_GE(found.range, 0);
      ASSERT_LE(found.range, range);
      // The point that the range says lies in a cell of what was hit.
      const double far_x = from.x + found.range * std::cos(from.a);
      const double far_y = from.y + found.range * std::sin(from.a);
      bool close = false;
      for (int dx = -1; dx <= 1; dx++)
        for (int dy = -1; dy <= 1; dy++) {
          const auto at = picture.find({static_cast<int64_t>(std::floor(far_x * 50 + dx * 0.001)),
                                        static_cast<int64_t>(std::floor(far_y * 50 + dy * 0.001))});
          close |= at != picture.end();
        }
      ASSERT_TRUE(close) << from.String() << " " << found.range;
    }
  }
  EXPECT_GT(hits, 12000);
}

TEST(RandomWorlds, ARayBackSeesTheSameGap) {
  // Both ends of a free line of sight agree that it is free, and a body across it is seen by both.
  RandomSource random(3);
  const std::unique_ptr<World> world = EmptyWorld();
  Model* box = AddBox(world.get(), Size(0.2, 0.2, 1), Pose());
  for (int i = 0; i < 5000; i++) {
    const double heading = random.Real(-3, 3), length = random.Real(2, 20);
    const Pose a(random.Real(-10, 10), random.Real(-10, 10), 0.5, heading);
    const Pose b(a.x + length * std::cos(heading), a.y + length * std::sin(heading), 0.5,
                 normalize(heading + M_PI));
    const double part = random.Real(0.2, 0.8) * length;
    box->SetPose(Pose(a.x + part * std::cos(heading), a.y + part * std::sin(heading), 0,
                      random.Real(-3, 3)));
    EXPECT_EQ(Look(world.get(), a, length).mod, box);
    EXPECT_EQ(Look(world.get(), b, length).mod, box);
    box->AddToPose(-0.5 * std::sin(heading), 0.5 * std::cos(heading), 0, 0);
    EXPECT_EQ(Look(world.get(), a, length).mod, nullptr);
    EXPECT_EQ(Look(world.get(), b, length).mod, nullptr);
  }
}

}  // namespace
}  // namespace Stg
