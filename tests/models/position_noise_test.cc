// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random odometry errors and slipping wheels: the errors of 1000 robots with random numbers of
// their own against the covariances that these report.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/trigonometry.hh"
#include "position_testing.hh"

namespace Stg {
namespace {

constexpr int kRobots = 1000;
// A sum of many independent terms lies further than this from its mean in one of 2000 cases.
constexpr double kSigmas = 3.5;

using Error = std::array<double, 3>;  // x, y, heading

/// Robots that pass through each other.
std::unique_ptr<World> Crowd(const std::string& properties) {
  std::string text = "interval_sim 100 resolution 0.5\n";
  for (int i = 0; i < kRobots; i++)
    text += "position( name \"r" + std::to_string(i) +
            "\" size [0.1 0.1 0.1] obstacle_return 0 alwayson 1 localization \"odom\" "
            "odom_error [0 0 0 0] " +
            properties + " )\n";
  return LoadText(text);
}

std::vector<ModelPosition*> RobotsOf(const World& world) {
  std::vector<ModelPosition*> robots;
  for (int i = 0; i < kRobots; i++)
    robots.push_back(Find<ModelPosition>(world, "r" + std::to_string(i)));
  return robots;
}

/// The error of an estimate, in the frame of the odometry.
Error ErrorOf(const ModelPosition& robot) {
  const Pose truth = robot.GetSensedPose(), &seen = robot.est_pose;
  return {seen.x - truth.x, seen.y - truth.y, normalize(seen.a - truth.a)};
}

/// Returns e^T C^-1 e.
double Mahalanobis(const Error& e, const PoseCovariance& c) {
  const double xx = c.yy * c.aa - c.ya * c.ya, xy = c.xa * c.ya - c.xy * c.aa,
               xa = c.xy * c.ya - c.xa * c.yy, yy = c.xx * c.aa - c.xa * c.xa,
               ya = c.xy * c.xa - c.xx * c.ya, aa = c.xx * c.yy - c.xy * c.xy;
  const double determinant = c.xx * xx + c.xy * xy + c.xa * xa;
  return (xx * e[0] * e[0] + yy * e[1] * e[1] + aa * e[2] * e[2] +
          2 * (xy * e[0] * e[1] + xa * e[0] * e[2] + ya * e[1] * e[2])) /
         determinant;
}

struct Path {
  const char* name;
  const char* drive;
  Velocity command;
};
void PrintTo(const Path& path, std::ostream* out) { *out << path.name; }

class Noise : public testing::TestWithParam<Path> {
 protected:
  static std::unique_ptr<World> Drive(int steps) {
    const Path& path = GetParam();
    auto world = Crowd("odom_noise [0.02 0.01 2 1] drive \"" + std::string(path.drive) + "\"");
    for (ModelPosition* robot : RobotsOf(*world)) robot->SetSpeed(path.command);
    Step(*world, steps);
    return world;
  }
};

TEST_P(Noise, TheSampleCovarianceLiesWithinTheConfidenceIntervalOfTheReportedOne) {
  const auto world = Drive(101);
  const std::vector<ModelPosition*> robots = RobotsOf(*world);
  double sample[3][3] = {}, reported[3][3] = {}, mean[3] = {}, distance = 0;
  for (const ModelPosition* robot : robots) {
    const Error error = ErrorOf(*robot);
    const PoseCovariance covariance = robot->GetOdomCovariance();
    distance += Mahalanobis(error, covariance);
    for (int i = 0; i < 3; i++) {
      const auto row = static_cast<size_t>(i);
      mean[i] += error[row] / kRobots;
      for (int k = 0; k < 3; k++) {
        sample[i][k] += error[row] * error[static_cast<size_t>(k)] / kRobots;
        reported[i][k] += covariance.At(i, k) / kRobots;
      }
    }
  }
  for (int i = 0; i < 3; i++) {
    EXPECT_GT(reported[i][i], 0) << i;
    // The mean of n errors has the variance C / n; second-order terms may shift it a little.
    EXPECT_LT(std::fabs(mean[i]), (kSigmas + 1) * std::sqrt(reported[i][i] / kRobots)) << i;
    for (int k = 0; k <= i; k++) {
      // Variance of an element of a sample covariance: (C_ii C_kk + C_ik^2) / n (Wishart).
      const double spread =
          std::sqrt((reported[i][i] * reported[k][k] + reported[i][k] * reported[i][k]) / kRobots);
      EXPECT_NEAR(sample[i][k], reported[i][k], kSigmas * spread) << i << ' ' << k;
    }
  }
  // The sum of e^T C^-1 e over n robots is distributed as chi-square with 3 n degrees of freedom:
  // mean 3 n, variance 6 n.
  EXPECT_NEAR(distance, 3 * kRobots, kSigmas * std::sqrt(6.0 * kRobots));
}

/// Error of the second leg alone, seen from the estimate and from the pose at its beginning.
Error ErrorOfLeg(const Pose& estimate0, const Pose& truth0, const ModelPosition& robot) {
  const auto from = [](const Pose& start, const Pose& end) {
    const SineCosine turn = SinCos(start.a);
    const double dx = end.x - start.x, dy = end.y - start.y;
    return Pose(turn.cosine * dx + turn.sine * dy, turn.cosine * dy - turn.sine * dx, 0,
                normalize(end.a - start.a));
  };
  const Pose seen = from(estimate0, robot.est_pose), made = from(truth0, robot.GetSensedPose());
  return {seen.x - made.x, seen.y - made.y, normalize(seen.a - made.a)};
}

TEST_P(Noise, ErrorsOfTwoLegsAreUncorrelated) {
  const auto world = Drive(51);
  const std::vector<ModelPosition*> robots = RobotsOf(*world);
  std::vector<Error> first, second;
  std::vector<Pose> estimates, truths;
  for (const ModelPosition* robot : robots) {
    first.push_back(ErrorOf(*robot));
    estimates.push_back(robot->est_pose);
    truths.push_back(robot->GetSensedPose());
  }
  Step(*world, 50);
  for (size_t i = 0; i < robots.size(); i++)
    second.push_back(ErrorOfLeg(estimates[i], truths[i], *robots[i]));
  for (size_t axis = 0; axis < 3; axis++) {
    double one = 0, two = 0, both = 0;
    for (size_t i = 0; i < robots.size(); i++) {
      one += first[i][axis] * first[i][axis];
      two += second[i][axis] * second[i][axis];
      both += first[i][axis] * second[i][axis];
    }
    ASSERT_GT(one * two, 0) << axis;
    EXPECT_LT(std::fabs(both / std::sqrt(one * two)), kSigmas / std::sqrt(kRobots)) << axis;
  }
}

TEST_P(Noise, TheVelocityHasTheNoiseOfTheStepAndItsCovariance) {
  const auto world = Drive(3);
  double square = 0, reported = 0;
  for (const ModelPosition* robot : RobotsOf(*world)) {
    const double error = robot->GetEstimatedVelocity().a - robot->GetActualVelocity().a;
    square += error * error / kRobots;
    reported += robot->GetOdomVelocityCovariance().aa / kRobots;
  }
  EXPECT_NEAR(square, reported, kSigmas * reported * std::sqrt(2.0 / kRobots));
}

const Path kPaths[] = {{"Straight", "diff", {0.5, 0, 0, 0}},
                       {"Turning", "diff", {0, 0, 0, 0.5}},
                       {"Curved", "diff", {0.5, 0, 0, 0.3}},
                       {"Sideways", "omni", {0.3, 0.4, 0, -0.2}},
                       {"Car", "car", {0.5, 0, 0, 0.3}}};
INSTANTIATE_TEST_SUITE_P(Paths, Noise, testing::ValuesIn(kPaths),
                         [](const auto& test) { return std::string(test.param.name); });

// ---- one robot ----------------------------------------------------------------------------------

TEST(OdomNoise, WithoutItNoNumberIsDrawnAndNoCovarianceReported) {
  Robot plain("localization \"odom\""), noisy("localization \"odom\" odom_noise [0.1 0 0 0]");
  for (Robot* robot : {&plain, &noisy}) {
    robot->position->SetSpeed(0.5, 0, 0);
    Step(*robot->world, 5);
  }
  Robot fresh("localization \"odom\"");
  EXPECT_EQ(plain.position->random().Next(), fresh.position->random().Next());
  EXPECT_NE(noisy.position->random().Next(), fresh.position->random().Next());
  EXPECT_EQ(plain.position->GetOdomCovariance().xx, 0);
  EXPECT_NEAR(noisy.position->GetOdomCovariance().xx, 0.01 * 0.2, 1e-3);
}

TEST(OdomNoise, HasNoEffectWithGpsOrAtRest) {
  Robot gps("odom_noise [0.1 0.1 5 5]"), rest("localization \"odom\" odom_noise [0.1 0.1 5 5]");
  gps.position->SetSpeed(0.5, 0, 0);
  Step(*gps.world, 5);
  Step(*rest.world, 5);
  ExpectPose(gps.position->est_pose, 0.2, 0, 0, 0);
  ExpectPose(rest.position->est_pose, 0, 0, 0, 0, 0);
  for (const Robot* robot : {&gps, &rest}) EXPECT_EQ(robot->position->GetOdomCovariance().aa, 0);
}

TEST(OdomNoise, SettingTheEstimateMakesItExact) {
  Robot robot("localization \"odom\" odom_noise [0.1 0.1 5 5]");
  robot.position->SetSpeed(0.5, 0, 0.3);
  Step(*robot.world, 5);
  EXPECT_GT(robot.position->GetOdomCovariance().xx, 0);
  robot.position->SetOdom(Pose());
  EXPECT_EQ(robot.position->GetOdomCovariance().xx, 0);
}

TEST(OdomNoise, RefusesNegativeDeviationsAndSlipOutsideOfZeroToOne) {
  EXPECT_FALSE(TryToLoad("position( odom_noise [0 -0.1 0 0] )").loaded);
  EXPECT_FALSE(TryToLoad("position( odom_noise [0 0.1] )").loaded);
  EXPECT_FALSE(TryToLoad("position( wheel_slip 1.1 )").loaded);
  EXPECT_FALSE(TryToLoad("position( wheel_slip -0.1 )").loaded);
}

// ---- slipping wheels ----------------------------------------------------------------------------

TEST(WheelSlip, OdometryCountsThatShareOfTheMotionThatAWallHinders) {
  for (const double slip : {0.0, 0.25, 1.0}) {
    Robot robot("localization \"odom\" odom_error [0 0 0 0] wheel_slip " + std::to_string(slip),
                "model( pose [0.7 0 0 0] )");
    ModelPosition& p = *robot.position;
    p.SetSpeed(0.5, 0, 0);
    while (!p.Stalled()) Step(*robot.world);
    Step(*robot.world);
    const double before = p.est_pose.x;
    Step(*robot.world, 10);
    EXPECT_NEAR(p.est_pose.x - before, slip * 0.5, 1e-12);
    ExpectPose(p.GetActualVelocity(), 0, 0, 0, 0);
    ExpectPose(p.GetEstimatedVelocity(), slip * 0.5, 0, 0, 0);
  }
}

TEST(WheelSlip, ChangesNothingWhileNothingHindersTheRobot) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0] wheel_slip 1");
  robot.position->SetSpeed(0.5, 0, 0.2);
  Step(*robot.world, 20);
  const Pose truth = robot.position->GetSensedPose(), seen = robot.position->est_pose;
  ExpectPose(seen, truth.x, truth.y, 0, truth.a);
}

}  // namespace
}  // namespace Stg
