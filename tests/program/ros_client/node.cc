// SPDX-License-Identifier: GPL-2.0-or-later
//
// Uses the parts of Stage's interface that ROS nodes use. Finds robots by callbacks, subscribes to
// their sensors, reads them in each step, drives, and resets positions. `node WORLD` runs without a
// window, `node WORLD --window` with one if it is compiled for that. Prints lines that
// ros_client_test.py checks. Written in C++11.

#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "stage.hh"

namespace {

const int kSteps = 10;

struct Robot {
  Stg::ModelPosition* position;
  std::vector<Stg::ModelRanger*> rangers;
  std::vector<Stg::ModelCamera*> cameras;
  Stg::Pose begin;
};

struct Node {
  Stg::World* world;
  std::vector<Robot> robots;
  int updates;
  double last_time;  // seconds
  bool went_back;
  size_t samples;  // in the last step
  double nearest;  // metres
  unsigned pixels_seen;

  explicit Node(Stg::World* of)
      : world(of),
        updates(0),
        last_time(-1),
        went_back(false),
        samples(0),
        nearest(1e9),
        pixels_seen(0) {}
};

/// The robot that carries a model.
Robot* RobotOf(Node* node, Stg::Model* model) {
  while (model->Parent()) model = model->Parent();
  for (size_t i = 0; i < node->robots.size(); i++)
    if (static_cast<Stg::Model*>(node->robots[i].position) == model) return &node->robots[i];
  return nullptr;
}

int NoteRobot(Stg::Model* model, void* user) {
  Node* const node = static_cast<Node*>(user);
  Stg::ModelPosition* const position = dynamic_cast<Stg::ModelPosition*>(model);
  if (position && !model->Parent()) {
    Robot robot;
    robot.position = position;
    robot.begin = position->GetGlobalPose();
    node->robots.push_back(robot);
  }
  return 0;
}

int NoteSensor(Stg::Model* model, void* user) {
  Robot* const robot = RobotOf(static_cast<Node*>(user), model);
  if (!robot) return 0;
  if (Stg::ModelRanger* const ranger = dynamic_cast<Stg::ModelRanger*>(model))
    robot->rangers.push_back(ranger);
  if (Stg::ModelCamera* const camera = dynamic_cast<Stg::ModelCamera*>(model))
    robot->cameras.push_back(camera);
  return 0;
}

void Subscribe(const Node& node) {
  for (size_t i = 0; i < node.robots.size(); i++) {
    const Robot& robot = node.robots[i];
    robot.position->Subscribe();
    for (size_t k = 0; k < robot.rangers.size(); k++) robot.rangers[k]->Subscribe();
    for (size_t k = 0; k < robot.cameras.size(); k++) robot.cameras[k]->Subscribe();
  }
}

void ReadRanger(Node* node, const Stg::ModelRanger& ranger) {
  const std::vector<Stg::ModelRanger::Sensor>& sensors = ranger.GetSensors();
  for (size_t i = 0; i < sensors.size(); i++) {
    const Stg::ModelRanger::Sensor& sensor = sensors[i];
    if (sensor.ranges.empty()) continue;
    const double increment = sensor.fov / static_cast<double>(sensor.sample_count - 1);
    if (!(increment > 0 && sensor.range.min <= sensor.range.max)) std::printf("bad sensor\n");
    if (sensor.intensities.size() != sensor.ranges.size()) std::printf("bad intensities\n");
    for (size_t k = 0; k < sensor.ranges.size(); k++)
      node->nearest = std::min(node->nearest, sensor.ranges[k]);
    node->samples += sensor.sample_count;
  }
}

void ReadCamera(Node* node, Stg::ModelCamera* camera) {
  const GLubyte* const colours = camera->FrameColor();
  const GLfloat* const depths = camera->FrameDepth();
  if (!colours || !depths) return;
  const int count = camera->getWidth() * camera->getHeight();
  const Stg::PerspectiveCamera& lens = camera->getCamera();
  if (!(lens.horizFov() > 0 && lens.vertFov() > 0 && lens.nearClip() < lens.farClip()))
    std::printf("bad lens\n");
  if (!std::isfinite(lens.pitch() + lens.yaw())) std::printf("bad mount\n");
  for (int i = 0; i < count; i++)
    if (colours[4 * i] + colours[4 * i + 1] + colours[4 * i + 2] > 0 && depths[i] < lens.farClip())
      node->pixels_seen++;
}

void Tell(const Node& node) {
  for (size_t i = 0; i < node.robots.size(); i++) {
    const Robot& robot = node.robots[i];
    const Stg::Pose estimate = robot.position->est_pose, truth = robot.position->GetGlobalPose();
    const Stg::Velocity velocity = robot.position->GetVelocity();
    const Stg::Pose mount = robot.rangers.empty() ? Stg::Pose() : robot.rangers[0]->GetPose();
    std::printf(
        "robot %s %s rangers %zu cameras %zu at %.3f %.3f estimated %.3f speed %.3f mount %.3f "
        "height %.3f\n",
        robot.position->Token(), robot.position->TokenStr().c_str(), robot.rangers.size(),
        robot.cameras.size(), truth.x, truth.y, estimate.x, velocity.x, mount.x,
        robot.position->GetGeom().size.z);
  }
  std::printf("updates %d time %.1f back %d samples %zu nearest %.2f\n", node.updates,
              node.last_time, node.went_back, node.samples, node.nearest);
  std::printf("camera %s\n", node.pixels_seen > 0 ? "sees" : "sees nothing");
}

/// Resets positions, like a ROS service for it.
void PutBack(Node* node) {
  for (size_t i = 0; i < node->robots.size(); i++) {
    node->robots[i].position->SetPose(node->robots[i].begin);
    node->robots[i].position->SetStall(false);
  }
}

/// Called after each step.
int Update(Stg::World* world, void* user) {
  Node* const node = static_cast<Node*>(user);
  const double time = static_cast<double>(world->SimTimeNow()) / 1e6;
  node->went_back = node->went_back || time <= node->last_time;
  node->last_time = time;
  node->updates++;
  node->samples = node->pixels_seen = 0;
  for (size_t i = 0; i < node->robots.size(); i++) {
    const Robot& robot = node->robots[i];
    for (size_t k = 0; k < robot.rangers.size(); k++) ReadRanger(node, *robot.rangers[k]);
    for (size_t k = 0; k < robot.cameras.size(); k++) ReadCamera(node, robot.cameras[k]);
    robot.position->SetSpeed(0.2, 0, i == 0 ? 0.0 : Stg::normalize(6.5));
  }
  if (node->updates == kSteps || node->updates == 2 * kSteps) Tell(*node);
  if (node->updates == kSteps) PutBack(node);
  if (node->updates == 2 * kSteps) world->QuitAll();
  return 0;
}

}  // namespace

int main(int argc, char* argv[]) {
  Stg::Init(&argc, &argv);
  const bool in_window = argc > 2 && std::strcmp(argv[2], "--window") == 0;
#ifdef WITH_WINDOW
  Stg::World* const world =
      in_window ? new Stg::WorldGui(600, 400, "Node") : new Stg::World("node");
#else
  Stg::World* const world = new Stg::World("node");
#endif
  if (!world->Load(argv[1])) return 1;
  Node node(world);
  const Stg::model_callback_t find_robots = NoteRobot, find_sensors = NoteSensor;
  const Stg::world_callback_t update = Update;
  world->ForEachDescendant(find_robots, &node);
  world->ForEachDescendant(find_sensors, &node);
  Subscribe(node);
  world->AddUpdateCallback(update, &node);
  world->Start();
  if (in_window) {
    Stg::World::Run();
  } else {
    while (!Stg::World::UpdateAll()) {
    }
  }
  std::printf("over\n");
  return 0;
}
