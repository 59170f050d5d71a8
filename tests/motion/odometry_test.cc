// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random errors of odometry and their covariance, without a world.

#include "motion/odometry.hh"

#include <gtest/gtest.h>

#include <cmath>

#include "models/noise.hh"
#include "random/random.hh"

namespace Stg {
namespace {

constexpr NoisyOdometry::Noise kNoise{0.02, 0.01, 0.05, 0.03};

/// Derivative of the composition of two poses, by differences.
struct Jacobian {
  double of[3][6];

  Jacobian(const Pose& before, const Pose& motion) {
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; k++) {
      Pose ends[2];
      for (const int side : {0, 1}) {
        Pose b = before, m = motion;
        Pose& moved = k < 3 ? b : m;
        const double shift = side ? kStep : -kStep;
        (k % 3 == 0 ? moved.x : k % 3 == 1 ? moved.y : moved.a) += shift;
        ends[side] = b + m;
      }
      of[0][k] = (ends[1].x - ends[0].x) / (2 * kStep);
      of[1][k] = (ends[1].y - ends[0].y) / (2 * kStep);
      of[2][k] = normalize(ends[1].a - ends[0].a) / (2 * kStep);
    }
  }
};

PoseCovariance Random(RandomStream* random) {
  double root[3][3];
  for (auto& row : root)
    for (double& element : row) element = random->Uniform(-1, 1);
  const auto product = [&](int i, int k) {
    return root[i][0] * root[k][0] + root[i][1] * root[k][1] + root[i][2] * root[k][2];
  };
  PoseCovariance covariance;
  covariance.xx = product(0, 0);
  covariance.xy = product(0, 1);
  covariance.yy = product(1, 1);
  covariance.xa = product(0, 2);
  covariance.ya = product(1, 2);
  covariance.aa = product(2, 2);
  return covariance;
}

TEST(Compose, EqualsTheProductWithTheDerivativesOfTheComposition) {
  RandomStream random(7);
  for (int trial = 0; trial < 200; trial++) {
    const Pose before = Pose::Random(random, -3, 3, -3, 3),
               motion = Pose::Random(random, -1, 1, -1, 1);
    const PoseCovariance p = Random(&random), q = Random(&random);
    const Jacobian jacobian(before, motion);
    const PoseCovariance sum = motion::Compose(before, p, motion, q);
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++) {
        double expected = 0;
        for (int m = 0; m < 3; m++)
          for (int n = 0; n < 3; n++)
            expected += jacobian.of[i][m] * p.At(m, n) * jacobian.of[k][n] +
                        jacobian.of[i][m + 3] * q.At(m, n) * jacobian.of[k][n + 3];
        EXPECT_NEAR(sum.At(i, k), expected, 1e-6);
      }
  }
}

/// Covariance after 2 m of way and 1 rad of turning in `steps` steps of a second in total.
PoseCovariance AfterSteps(int steps) {
  NoisyOdometry odometry(kNoise);
  const double none[2] = {0, 0}, dt = 1.0 / steps;
  Pose driven;
  for (int i = 0; i < steps; i++) {
    const Velocity v = odometry.Measure(Velocity(2, 0, 0, 1), dt, none, driven);
    driven = driven + Pose(v.x * dt, 0, 0, v.a * dt);
  }
  odometry.Refresh(Pose(), driven);
  return odometry.covariance();
}

TEST(NoisyOdometry, TheCovarianceDoesNotDependOnTheLengthOfASteps) {
  const PoseCovariance coarse = AfterSteps(100), fine = AfterSteps(1000);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) EXPECT_NEAR(coarse.At(i, k), fine.At(i, k), 0.02 * fine.aa);
  EXPECT_NEAR(fine.aa, 2 * 0.03 * 0.03 + 0.05 * 0.05, 1e-12);
}

TEST(NoisyOdometry, RefreshingOftenOrOnceGivesTheSameCovariance) {
  NoisyOdometry often(kNoise), once(kNoise);
  const double none[2] = {0, 0}, dt = 0.1;
  Pose estimate, driven;
  for (int i = 0; i < 50; i++) {
    const Velocity twist(0.5, 0.2, 0, 0.4);
    often.Measure(twist, dt, none, Pose());
    once.Measure(twist, dt, none, driven);
    const Pose motion(twist.x * dt, twist.y * dt, 0, twist.a * dt);
    often.Refresh(estimate, motion);
    estimate = estimate + motion;
    driven = driven + motion;
  }
  once.Refresh(Pose(), driven);
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++)
      EXPECT_NEAR(often.covariance().At(i, k), once.covariance().At(i, k), 1e-12);
}

TEST(NoisyOdometry, ErrorsLieInTheDirectionOfMotionOrForwardsWhenTurningOnTheSpot) {
  NoisyOdometry odometry(kNoise);
  const double one[2] = {1, 1};
  odometry.Measure(Velocity(0, 0.5, 0, 0), 0.1, one, Pose());
  EXPECT_EQ(odometry.twist_error().x, 0);
  EXPECT_NEAR(odometry.twist_error().y, 0.02 * std::sqrt(0.05) / 0.1, 1e-12);
  odometry.Measure(Velocity(0, 0, 0, -2), 0.1, one, Pose());
  EXPECT_NEAR(odometry.twist_error().x, 0.01 * std::sqrt(0.2) / 0.1, 1e-12);
  EXPECT_NEAR(odometry.twist_error().a, 0.05 * std::sqrt(0.2) / 0.1, 1e-12);
  const PoseCovariance covariance = odometry.CovarianceOf(Velocity(0, 0, 0, -2), 0.1);
  EXPECT_NEAR(covariance.aa, std::pow(odometry.twist_error().a, 2), 1e-12);
  EXPECT_NEAR(covariance.xx, std::pow(odometry.twist_error().x, 2), 1e-12);
}

}  // namespace
}  // namespace Stg
