// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/closed_world.hh"

#include "stage.hh"
#include "world/engine.hh"

namespace Stg::test {

namespace {

std::string Number(double value) { return std::to_string(value); }

std::string Pose2(double x, double y, double degrees) {
  return " pose [" + Number(x) + " " + Number(y) + " 0 " + Number(degrees) + "]";
}

/// Some of the errors of readings other than noise.
std::string DefectsText(RandomSource* random) {
  std::string text;
  if (random->OneIn(2)) text += " blind_near 1";
  if (random->OneIn(2)) text += " loss " + Number(random->Real(0, 0.5));
  if (random->OneIn(2)) text += " range_step " + Number(random->Real(0.001, 0.2));
  if (random->OneIn(2)) text += " steepest " + Number(random->Real(10, 90));
  return text;
}

std::string SensorText(RandomSource* random) {
  std::string text = " sensor( range [" + std::string(random->OneIn(4) ? "0.3 " : "0 ") +
                     Number(random->Real(0.3, 6)) + "] fov " + Number(random->Real(0, 360)) +
                     " samples " + std::to_string(random->Int(1, 40));
  if (random->OneIn(2)) text += " size [0.1 0.1 " + Number(random->Real(0, 0.3)) + "]";
  if (random->OneIn(2)) text += Pose2(random->Real(-0.1, 0.1), 0, random->Real(-180, 180));
  if (random->OneIn(3)) text += " noise [0.01 0.05 " + Number(random->OneIn(2) ? 0 : 0.7) + "]";
  if (random->OneIn(4)) text += DefectsText(random);
  if (random->OneIn(6))
    text += R"( ray_model ")" + std::string(random->OneIn(2) ? "exact" : "cell") + "\"";
  return text + " )";
}

std::string RangerText(RandomSource* random) {
  std::string text = " ranger(" + Pose2(random->Real(-0.1, 0.1), random->Real(-0.1, 0.1),
                                        random->OneIn(2) ? 0 : random->Real(-180, 180));
  if (random->OneIn(3))
    text +=
        " block( points 4 point[0] [0 0] point[1] [0 1] point[2] [1 1] point[3] [1 0] z [0 0.1] )";
  for (int i = random->Int(1, 2); i > 0; i--) text += SensorText(random);
  return text + " )";
}

std::string BumperText(double size, RandomSource* random) {
  std::string text = " bumper( size [0.01 0.01 0.05]" + Pose2(random->Real(-0.05, 0.05), 0, 0);
  const int lines = random->Int(0, 3);
  text += " bcount " + std::to_string(lines) + " blength " + Number(random->Real(0, 0.6));
  for (int i = 0; i < lines; i++)
    text += " bpose[" + std::to_string(i) + "] [" + Number(random->Real(0.3, 0.8) * size) + " " +
            Number(random->Real(-0.1, 0.1)) + " 0 " + Number(random->Real(-40, 40)) + "]";
  return text + " )";
}

/// Lines at all sides of a robot without an origin: there, contacts of outlines count.
std::string BumpersAllAround(double length, double width) {
  const std::string x = Number(length / 2), y = Number(width / 2);
  return " bumper( size [0.01 0.01 0.05] bcount 4 blength " + Number(length) + " bpose[0] [" + x +
         " 0 0 0] bpose[1] [-" + x + " 0 0 180] bpose[2] [0 " + y + " 0 90] bpose[3] [0 -" + y +
         " 0 -90] )";
}

std::string FiducialText(RandomSource* random) {
  std::string text = " fiducial(" + Pose2(random->Real(-0.1, 0.1), 0, random->Real(-90, 90)) +
                     " fov " + Number(random->Real(30, 360)) + " range_max " +
                     Number(random->Real(0, 8)) + " range_max_id " + Number(random->Real(0, 4));
  if (random->OneIn(3)) text += " ignore_zloc 1";
  if (random->OneIn(4)) text += " fiducial_key 1";
  return text + " )";
}

std::string BlobfinderText(RandomSource* random) {
  std::string text = " blobfinder(" + Pose2(0.05, 0, random->Real(-90, 90)) + " image [" +
                     std::to_string(random->Int(0, 300)) + " 60] fov " +
                     Number(random->Real(10, 360)) + " range " + Number(random->Real(0, 8)) +
                     " pan " + Number(random->Real(-90, 90));
  if (random->OneIn(3)) text += " colors_count 2 colors [ \"blue\" \"red\" ]";
  return text + " )";
}

/// Sensors other than rangers.
std::string FindersText(double size, RandomSource* random) {
  std::string text;
  if (random->OneIn(4)) text += BumperText(size, random);
  if (random->OneIn(4)) text += FiducialText(random);
  if (random->OneIn(5)) text += BlobfinderText(random);
  return text;
}

/// Properties of a model that finders see.
std::string LooksText(RandomSource* random) {
  std::string text;
  if (random->OneIn(2)) text += " fiducial_return " + std::to_string(random->Int(-2, 9));
  if (random->OneIn(6)) text += " fiducial_key 1";
  if (random->OneIn(6)) text += " blob_return 0";
  if (random->OneIn(2)) text += " color \"" + random->Pick<std::string>({"blue", "green"}) + "\"";
  return text;
}

std::string ShapeText(RandomSource* random) {
  switch (random->Int(0, 4)) {
    case 0:
      return "";
    case 1:
      return " round 1";
    case 2:
      return " block( points 3 point[0] [0 0] point[1] [2 1] point[2] [0 2] z [0 1] )";
    case 3:
      return " block( points 6 point[0] [0.75 0] point[1] [1 0.25] point[2] [1 0.75] point[3] "
             "[0.75 1] "
             "point[4] [0 1] point[5] [0 0] z [0 1] )";
    default:
      return " block( points 4 point[0] [0 0] point[1] [0 1] point[2] [1 1] point[3] [1 0] z [0 "
             "0.5] )"
             " block( points 4 point[0] [0.5 0] point[1] [0.5 2] point[2] [1 2] point[3] [1 0] z "
             "[0.2 1] )";
  }
}

/// A robot that stands, goes on or goes to a place.
std::string BehaviourText(const std::string& place, RandomSource* random) {
  const std::string turn = random->OneIn(3) ? " turn=0" : "";
  return "stage/behaviour kind=" + std::to_string(random->Int(0, 4)) + place +
         " vx=" + Number(random->Real(-1, 1)) + " vy=" + Number(random->Real(-1, 1)) +
         " rate=" + Number(random->OneIn(2) ? 0 : random->Real(-1, 1)) + turn;
}

/// One to four goals.
std::string RouteText(RandomSource* random) {
  std::string text;
  for (int i = 2 * random->Int(1, 4); i > 0; i--)
    text += (text.empty() ? "" : ",") + Number(random->Real(-3, 3));
  return text;
}

/// A built-in controller and what it needs.
std::string ControllerText(RandomSource* random) {
  const std::string place =
      " x=" + Number(random->Real(-3, 3)) + " y=" + Number(random->Real(-3, 3));
  const std::string controllers = random->Pick<std::string>(
      {"stage/wander", "stage/wander speed=0.7 turn=1.2 front=0.6", "stage/disperse",
       "stage/disperse speed=1 horizon=3 margin=0.02", "stage/goal" + place,
       "stage/goal heading=50" + place, "stage/pedestrian" + place,
       "stage/pedestrian speed=0.5 radius=0.4" + place, "stage/goal" + place + "\" \"stage/wander",
       "stage/pedestrian near=1.5 wait=0.3 group=3 member=2 goals=" + RouteText(random),
       "stage/orca loop=1 near=1.5 goals=" + RouteText(random), "stage/orca" + place,
       "stage/orca speed=1 time=1 neighbours=2 range=2" + place, BehaviourText(place, random),
       BehaviourText(place, random)});
  const std::string text = " ctrl [\"" + controllers + "\"]";
  return text + " ranger( sensor( range [0 " + Number(random->Real(0.3, 6)) + "] fov " +
         Number(random->Real(30, 360)) + " samples " + std::to_string(random->Int(9, 40)) +
         (random->OneIn(3) ? " noise [0.01 0.05 0.7] ) )" : " ) )");
}

std::string RobotText(bool controlled, RandomSource* random, double x, double y) {
  const double size = random->Real(0.1, 0.5), width = size * random->Real(0.6, 1.2);
  const bool bumps = random->OneIn(4);
  std::string text = "position( size [" + Number(size) + " " + Number(width) + " " +
                     Number(random->Real(0.2, 0.6)) + "]" + Pose2(x, y, random->Real(-180, 180));
  text += bumps ? BumpersAllAround(size, width) : ShapeText(random);
  const char* const drives[] = {"diff", "omni", "car"};
  text += " drive \"" + std::string(drives[random->Int(0, 2)]) + "\"";
  if (!bumps && random->OneIn(2))
    text += " origin [" + Number(random->Real(-0.1, 0.1)) + " 0 0 " +
            Number(random->Real(-90, 90)) + "]";
  if (random->OneIn(3)) text += " localization \"odom\"";
  if (random->OneIn(2))
    text += " localization_origin" + random->Pick<std::string>({" [0 0 0 0]", " [0.5 -0.3 0 40]"});
  if (random->OneIn(4)) text += " odom_error [0.01 0.02 0 0.03]";
  if (random->OneIn(4)) text += " odom_noise [0.02 0.01 0.03 0.02]";
  if (random->OneIn(4)) text += " wheel_slip 0.5";
  if (random->OneIn(4)) text += " ranger_return " + Number(random->Real(-1, 2));
  if (random->OneIn(8)) text += " obstacle_return 0";
  if (random->OneIn(4)) text += " mass " + Number(random->Real(1, 20));
  if (random->OneIn(2)) text += " pushable 1";
  if (random->OneIn(6)) text += " velocity [0.2 0.1 0 30]";
  if (random->OneIn(3))
    text += " joules " + Number(random->Real(-5, 300)) + " joules_capacity " +
            Number(random->Real(50, 400));
  if (random->OneIn(3)) text += " stops_when_empty " + std::to_string(random->Int(0, 1));
  text += LooksText(random);
  if (controlled && random->OneIn(2)) text += ControllerText(random);
  for (int i = random->Int(0, 2); i > 0; i--) text += RangerText(random);
  text += FindersText(size, random);
  if (random->OneIn(6))
    text += " model( fiducial_return 5 size [0.1 0.1 0.4]" + Pose2(0.1, 0, 30) + " )";
  return text + " )\n";
}

std::string SceneryText(RandomSource* random, double room) {
  const bool pushable = random->OneIn(3), senses = random->OneIn(4);
  // Rows know no larger outlines of what moves or senses.
  const double longest = pushable || senses ? 0.6 : 1.5;
  std::string text =
      "model( size [" + Number(random->Real(0.05, longest)) + " " +
      Number(random->Real(0.05, longest)) + " " + Number(random->Real(0.05, 1)) + "]" +
      Pose2(random->Real(-room, room), random->Real(-room, room), random->Real(-180, 180)) +
      ShapeText(random);
  if (random->OneIn(4)) text += " ranger_return " + Number(random->Real(-1, 2));
  if (random->OneIn(6)) text += " obstacle_return 0";
  if (pushable)
    text += " pushable 1 mass " + Number(random->Real(0.1, 5)) + " friction " +
            Number(random->Real(0, 0.5));
  text += LooksText(random);
  if (senses) text += RangerText(random);
  if (senses) text += FindersText(0.3, random);
  text += " )\n";
  // Twice at one place: rays meet both at once.
  return random->OneIn(6) ? text + text : text;
}

/// Populations of robots, and of things that they push.
std::string PopulationsText(const ClosedWorldKind& kind, RandomSource* random) {
  const std::string side = Number(kind.room + 3);
  const std::string area = " area [-" + side + " -" + side + " " + side + " " + side + "] )\n";
  std::string text = "define bot " + RobotText(kind.controlled, random, 0, 0);
  text +=
      "population( name \"bots\" model \"bot\" count " + std::to_string(random->Int(1, 3)) + area;
  if (!kind.outlines || random->OneIn(2)) return text;
  return text + "define crate model( size [0.3 0.2 0.3] pushable 1 )\n" +
         "population( name \"crates\" model \"crate\" count 3" +
         (random->OneIn(2) ? " seed 7" : "") + area;
}

/// The text, with other update intervals for some robots and sensors.
std::string WithRates(const std::string& text, RandomSource* random) {
  std::string result;
  size_t begin = 0;
  for (size_t i = 0; i < text.size(); i++) {
    const auto opens = [&](const std::string& type) {
      return i + 1 >= type.size() && text.compare(i + 1 - type.size(), type.size(), type) == 0;
    };
    const bool updates = opens("position(") || opens("ranger(") || opens("bumper(") ||
                         opens("fiducial(") || opens("blobfinder(");
    if (!updates || random->OneIn(2)) continue;
    result += text.substr(begin, i + 1 - begin) + " update_interval " +
              std::to_string(random->Pick<int>({0, 50, 130, 200, 200, 300}));
    begin = i + 1;
  }
  return result + text.substr(begin);
}

}  // namespace

std::string ClosedWorld(const ClosedWorldKind& kind, RandomSource* random) {
  std::string text = "interval_sim " + std::to_string(random->Pick<int>({10, 100, 100, 250})) +
                     "\nresolution " + Number(random->Pick<double>({0.02, 0.05, 0.1})) +
                     "\ncontacts \"" + (kind.outlines ? "outlines" : "cells") + "\"\nray_model \"" +
                     (kind.exact ? "exact" : "cell") + "\"\n";
  for (int i = random->Int(0, 8); i > 0; i--) text += SceneryText(random, kind.room);
  for (int i = 0; i < kind.robots; i++)
    text += RobotText(kind.controlled, random, random->Real(-kind.room / 2, kind.room / 2),
                      random->Real(-kind.room / 2, kind.room / 2));
  if (random->OneIn(3)) text += PopulationsText(kind, random);
  return kind.several_rates ? WithRates(text, random) : text;
}

void SubscribeToMost(World* world, uint64_t idle) {
  for (Model* model : world->engine().models)
    if (model->GetModelType() != "model" && ((idle >> (model->GetId() % 64)) & 1) == 0)
      model->Subscribe();
}

}  // namespace Stg::test
