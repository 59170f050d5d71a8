// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs follow the conventions of ROS: ranges by REP 117, and covariances that are not all zero.

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "recording/log_testing.hh"
#include "recording/odometry_covariance.hh"
#include "recording/replay.hh"
#include "recording/ros_messages.hh"
#include "support/model_testing.hh"

namespace log_testing {

namespace {

using recording::OdometryCovariance;
using recording::RangeConvention;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

constexpr double kTurn = 20 * M_PI / 180;  // rad/s

/// A robot whose laser sees a wall at 2 m, nothing beyond, and a post that is nearer than its
/// minimum range. Its rays point left, ahead and right.
const char kRoom[] = R"(
ray_model "exact"
define bot position( size [0.2 0.2 0.2] alwayson 1 localization "odom" odom_error [0.02 0.03 0 2]
  drive "omni"
  ranger( alwayson 1 sensor( range [1 4] fov 180 samples 3 ) ) )
bot( name "r" pose [0 0 0 0] )
model( name "wall" pose [2.05 0 0 0] size [0.1 0.5 1] )
model( name "post" pose [0 0.6 0 0] size [0.2 0.2 1] )
)";

std::vector<std::vector<float>> RangesOf(const McapReader& log) {
  std::vector<std::vector<float>> scans;
  for (const ReadMessage& message : MessagesOf(log)) {
    if (message.type != "sensor_msgs/msg/LaserScan") continue;
    CdrReader from(message.data);
    const Header header(&from);
    for (int i = 0; i < 7; i++) from.Get<float>();
    const std::string_view bytes = from.GetSequence<float>();
    std::vector<float>& ranges = scans.emplace_back(bytes.size() / sizeof(float));
    std::copy(bytes.begin(), bytes.end(), reinterpret_cast<char*>(ranges.data()));
  }
  return scans;
}

/// Covariances of pose and velocity of each message on a topic.
std::vector<std::pair<OdometryCovariance::Matrix, OdometryCovariance::Matrix>> CovariancesOf(
    const McapReader& log, const std::string& topic) {
  std::vector<std::pair<OdometryCovariance::Matrix, OdometryCovariance::Matrix>> found;
  for (const ReadMessage& message : MessagesOf(log)) {
    if (message.topic != topic) continue;
    CdrReader from(message.data);
    const Header header(&from);
    from.GetText();
    for (int i = 0; i < 7; i++) from.Get<double>();
    auto& [pose, twist] = found.emplace_back();
    for (double& number : pose) number = from.Get<double>();
    for (int i = 0; i < 6; i++) from.Get<double>();
    for (double& number : twist) number = from.Get<double>();
    EXPECT_TRUE(from.is_good());
  }
  return found;
}

class ConventionsTest : public LogTest {
 protected:
  std::unique_ptr<World> Room() {
    auto world = std::make_unique<World>(OptionsOf(1));
    std::istringstream text(kRoom);
    EXPECT_TRUE(world->Load(text));
    auto* robot = dynamic_cast<ModelPosition*>(world->GetModel("r"));
    EXPECT_NE(robot, nullptr);
    robot->SetSpeed(0.1, 0.05, kTurn);
    return world;
  }
};

TEST_F(ConventionsTest, Ranges_AreInfiniteWhereNothingIsAndMinusInfiniteWhereSomethingIsTooNear) {
  const std::unique_ptr<World> world = Room();
  Log(world.get(), 1, "run.mcap");
  const auto scans = RangesOf(McapReader(Path("run.mcap")));
  ASSERT_EQ(scans.size(), 1u);
  ASSERT_EQ(scans[0].size(), 3u);
  EXPECT_EQ(scans[0][0], kInfinity);
  EXPECT_NEAR(scans[0][1], 2, 0.1);
  EXPECT_EQ(scans[0][2], -kInfinity);
}

TEST_F(ConventionsTest, Ranges_AreThoseOfStageIfThatIsAskedFor) {
  const std::unique_ptr<World> world = Room();
  recording::LogOptions options;
  options.ranges = RangeConvention::kStage;
  Log(world.get(), 1, "run.mcap", options);
  const auto scans = RangesOf(McapReader(Path("run.mcap")));
  ASSERT_EQ(scans.size(), 1u);
  EXPECT_EQ(scans[0][0], 4);
  EXPECT_NEAR(scans[0][1], 2, 0.1);
  EXPECT_NEAR(scans[0][2], 0.5, 0.1);
}

/// Older logs contain ranges in Stage's own convention.
TEST_F(ConventionsTest, Replay_ShowsTheMaximumAndTheMinimumForInfiniteRanges) {
  for (const RangeConvention ranges : {RangeConvention::kRep117, RangeConvention::kStage}) {
    ModelRanger::Sensor sensor;
    sensor.range = Bounds(1, 4);
    sensor.ranges = {4, 2, 0.5, std::nan("")};
    sensor.intensities = {0, 1, 1, 1};
    recording::ScanMaker maker("frame", 100000, ranges);
    std::string message(maker.Prepare(sensor), '\0');
    maker.Write(sensor, 0, reinterpret_cast<uint8_t*>(message.data()));
    std::vector<double> read, intensities;
    ASSERT_TRUE(recording::GetScan(message, &read, &intensities));
    ASSERT_EQ(read.size(), 4u);
    EXPECT_EQ(read[0], 4);
    EXPECT_EQ(read[1], 2);
    EXPECT_EQ(read[2], ranges == RangeConvention::kRep117 ? 1 : 0.5);
    EXPECT_TRUE(std::isnan(read[3]));
  }
}

TEST_F(ConventionsTest, Covariances_GrowWithTheWayAndAreNeverZero) {
  const std::unique_ptr<World> world = Room();
  Log(world.get(), 30, "run.mcap");
  const McapReader log(Path("run.mcap"));
  const auto odometry = CovariancesOf(log, "/odom"), truth = CovariancesOf(log, "/ground_truth");
  ASSERT_GE(odometry.size(), 20u);
  ASSERT_GE(truth.size(), 20u);
  for (const auto& [pose, twist] : truth)
    for (const auto* matrix : {&pose, &twist})
      for (size_t i = 0; i < 6; i++)
        EXPECT_EQ((*matrix)[7 * i],
                  i > 1 && i < 5 ? OdometryCovariance::kUnknown : OdometryCovariance::kExact);
  const auto& [first, ignored] = odometry.front();
  const auto& [last, twist] = odometry.back();
  const double share = 2 * M_PI / 180;
  for (const size_t axis : {0, 1, 5}) {
    EXPECT_GE(first[7 * axis], OdometryCovariance::kExact);
    EXPECT_GT(last[7 * axis], 100 * first[7 * axis]) << axis;
    EXPECT_GT(twist[7 * axis], OdometryCovariance::kExact) << axis;
  }
  for (size_t i = 0; i < 6; i++)
    for (size_t k = 0; k < 6; k++) EXPECT_DOUBLE_EQ(last[6 * i + k], last[6 * k + i]);
  const double turned = kTurn * 2.9;
  EXPECT_NEAR(std::sqrt(last[35]), share * turned, 0.1 * share * turned);
}

TEST(OdometryCovarianceTest, RandomErrorsAreAddedToThoseOfTheFactors) {
  OdometryCovariance covariance;
  for (int i = 0; i <= 10; i++) covariance.Move(Pose(0.5 * i, 0, 0, 0));
  const Velocity factors(0.02, 0, 0, 0);
  PoseCovariance random;
  random.xx = 0.5;
  random.xa = 0.25;
  random.aa = 2;
  const OdometryCovariance::Matrix without = covariance.OfPose(factors);
  const OdometryCovariance::Matrix with = covariance.OfPose(factors, random);
  EXPECT_DOUBLE_EQ(with[0], without[0] + 0.5);
  EXPECT_DOUBLE_EQ(with[5], without[5] + 0.25);
  EXPECT_DOUBLE_EQ(with[30], without[30] + 0.25);
  EXPECT_DOUBLE_EQ(with[35], without[35] + 2);
  EXPECT_DOUBLE_EQ(OdometryCovariance::OfTwist(Velocity(), factors, random)[35],
                   2 + OdometryCovariance::kExact);
}

TEST_F(ConventionsTest, Covariances_OfALogAreThoseOfTheRobot) {
  const auto world = LoadText(
      "position( name \"r\" alwayson 1 localization \"odom\" odom_error [0 0 0 0]\n"
      "  odom_noise [0.02 0.01 2 1] )");
  auto* const robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(0.5, 0, 0.4);
  Log(world.get(), 30, "noise.mcap");
  const McapReader log(Path("noise.mcap"));
  const auto odometry = CovariancesOf(log, "/odom");
  ASSERT_GE(odometry.size(), 20u);
  const auto& [pose, twist] = odometry.back();
  const PoseCovariance of_pose = robot->GetOdomCovariance(),
                       of_twist = robot->GetOdomVelocityCovariance();
  EXPECT_GT(of_pose.aa, 0);
  EXPECT_DOUBLE_EQ(pose[0], of_pose.xx + OdometryCovariance::kExact);
  EXPECT_DOUBLE_EQ(pose[1], of_pose.xy);
  EXPECT_DOUBLE_EQ(pose[11], of_pose.ya);
  EXPECT_DOUBLE_EQ(pose[35], of_pose.aa + OdometryCovariance::kExact);
  EXPECT_DOUBLE_EQ(twist[35], of_twist.aa + OdometryCovariance::kExact);
}

/// Driving straight ahead, a speed error shifts the robot ahead; a turn error has no effect.
TEST(OdometryCovarianceTest, StraightOn_TheErrorLiesAhead) {
  OdometryCovariance covariance;
  for (int i = 0; i <= 10; i++) covariance.Move(Pose(0, 0.5 * i, 0, M_PI / 2));
  const OdometryCovariance::Matrix matrix = covariance.OfPose(Velocity(0.02, 0.5, 0, 0.3));
  EXPECT_NEAR(matrix[7], std::pow(5 * 0.02, 2), 1e-8);
  EXPECT_NEAR(matrix[0], 0, 1e-8);
  EXPECT_NEAR(matrix[35], 0, 1e-8);
}

/// After a quarter turn and 3 m, a heading error of 0.1 rad shifts the end by 0.3 m.
TEST(OdometryCovarianceTest, AfterATurn_TheErrorOfTheHeadingTurnsTheWay) {
  OdometryCovariance covariance;
  covariance.Move(Pose(0, 0, 0, 0));
  covariance.Move(Pose(0, 0, 0, M_PI / 2));
  covariance.Move(Pose(0, 3, 0, M_PI / 2));
  const double share = 0.1 / (M_PI / 2);
  const OdometryCovariance::Matrix matrix = covariance.OfPose(Velocity(0, 0, 0, share));
  EXPECT_NEAR(matrix[0], 0.09, 1e-8);
  EXPECT_NEAR(matrix[7], 0, 1e-8);
  EXPECT_NEAR(matrix[35], 0.01, 1e-8);
  EXPECT_NEAR(matrix[5], -0.03, 1e-8);
}

}  // namespace

}  // namespace log_testing
