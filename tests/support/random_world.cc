// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/random_world.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "grid/grid.hh"
#include "support/all_models.hh"

namespace random_world {

using Stg::Model;
using Stg::ModelPosition;
using Stg::ModelRanger;

namespace {

/// Concatenates the parts, with numbers in fixed notation, because world files have no exponents.
template <typename... Parts>
std::string Text(const Parts&... parts) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(20);
  (text << ... << parts);
  return text.str();
}

}  // namespace

// ---- the world file -----------------------------------------------------------------------------

WorldText::WorldText(uint64_t seed, Returns returns)
    : random_(seed * 7919), seed_(seed), returns_(returns) {
  const double cells[] = {0.001, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 10.0};
  cell_ = OneOf(cells);
  const double offsets[] = {0, 0, 0, 20.48, -20.48, 1e3, -1e5, 1e6, -1e6};
  centre_x_ = OneOf(offsets);
  centre_y_ = OneOf(offsets);
  const double widths[] = {40, 100, 300};
  half_width_ = OneOf(widths) * cell_;
  steps_ = 8 + Below(12);

  text_ = Text("resolution ", cell_, "\nthreads ", 1 + Below(3), "\ncontacts \"",
               seed % 3 == 0 ? "cells" : "outlines", "\"\n");
  if (Chance(0.3)) text_ += "ray_model \"exact\"\n";
  // A frame around everything, aligned with the grid or not.
  if (Chance(0.7))
    text_ += Text("model( size [", 2 * half_width_, " ", 2 * half_width_, " 3] pose [", centre_x_,
                  " ", centre_y_, " 0 ", Chance(0.5) ? 0.0 : Heading(), "] )\n");
  const uint32_t obstacles = Below(12);
  for (uint32_t i = 0; i < obstacles; i++) text_ += Obstacle();
  const uint32_t robots = 5 + Below(36);
  for (uint32_t i = 0; i < robots; i++) text_ += Robot(i);
}

double WorldText::Heading() {
  if (Chance(0.4)) return 45.0 * (static_cast<int>(Below(9)) - 4);
  return random_.Uniform(-180, 180);
}

/// A random pose in the frame, sometimes exactly on borders and corners of cells.
std::string WorldText::Pose(double z) {
  const auto coordinate = [this](double centre) {
    const double value = centre + random_.Uniform(-1, 1) * half_width_;
    return Chance(0.3) ? std::floor(value / cell_) * cell_ : value;
  };
  const double x = coordinate(centre_x_), y = coordinate(centre_y_);
  return Text(" pose [", x, " ", y, " ", z, " ", Heading(), "]");
}

std::string WorldText::LocalPose(double reach, double z) {
  const double x = Chance(0.5) ? 0 : random_.Uniform(-reach, reach);
  const double y = Chance(0.5) ? 0 : random_.Uniform(-reach, reach);
  return Text(" pose [", x, " ", y, " ", z, " ", Chance(0.5) ? 0 : Heading(), "]");
}

/// A polygon that is convex, star-shaped or self-intersecting.
std::string WorldText::Polygon(double reach) {
  const uint32_t corners = 3 + Below(6);
  const bool star = Chance(0.7);
  std::string text = Text(" block( points ", corners);
  for (uint32_t i = 0; i < corners; i++) {
    const double angle = star ? 2 * M_PI * i / corners : random_.Uniform(0, 2 * M_PI);
    const double radius = reach * random_.Uniform(0.2, 1);
    text += Text(" point[", i, "] [", radius * std::cos(angle), " ", radius * std::sin(angle), "]");
  }
  const double bottom = Chance(0.6) ? 0 : 0.1 * Below(10);
  return text + Text(" z [", bottom, " ", bottom + 0.1 * (1 + Below(10)), "] )");
}

/// The size of a body, and its blocks unless it is a box.
std::string WorldText::Body(double size) {
  const bool thin = Chance(0.15);
  std::string text = Text(" size [", size, " ", thin ? 0.1 * cell_ : size * random_.Uniform(0.3, 1),
                          " ", 0.1 * (1 + Below(15)), "]");
  if (Chance(0.2))
    text += Text(" origin [", random_.Uniform(-1, 1) * size, " 0 0 ", Heading(), "]");
  if (Chance(0.4)) return text;
  const uint32_t blocks = 1 + Below(3);
  for (uint32_t i = 0; i < blocks; i++) text += Polygon(size);
  return text;
}

std::string WorldText::Obstacle() {
  const double sizes[] = {0.3, 0.9, 3, 10, 30, 100};
  const double size = (Chance(0.03) ? 6000 : OneOf(sizes)) * cell_;
  const double returns[] = {1, 0.5, 0, -1};
  return Text("model(", Pose(Chance(0.7) ? 0 : 0.1 * Below(10)), " ranger_return ",
              Return(OneOf(returns)), " obstacle_return ", Chance(0.8), Body(size), " )\n");
}

std::string WorldText::Sensor() {
  const double cells[] = {0, 1e-6, 0.4, 1, 3.5, 30, 64, 150, 400};
  double range = OneOf(cells) * cell_;
  uint32_t samples = 2 * Below(16) + 1;
  if (Chance(0.1)) samples = 360;
  if (Chance(0.2)) samples = Below(3);
  if (Chance(0.12)) {
    // Rays of several legs are slow, so use only a few samples.
    range = Chance(0.5) ? 1e9 : 20000 * cell_;
    samples = std::min(samples, 5u);
  }
  const double fovs[] = {0, 15, 90, 180, 270, 360, 720, -120};
  std::string text = Text(" sensor(", LocalPose(2 * cell_, 0), " size [0.02 0.02 ", 0.05 * Below(3),
                          "] range [0 ", range, "] samples ", samples, " fov ", OneOf(fovs));
  if (Chance(0.2))
    text += Text(" noise [", Chance(0.5) ? 0 : cell_ * cell_, " ", Chance(0.5) ? 0 : 0.1, " ",
                 Chance(0.5) ? 0 : 40, "]");
  if (Chance(0.1))
    text += Text(" blind_near 1 loss ", Chance(0.5) ? 0 : 0.3, " range_step ",
                 Chance(0.5) ? 0 : cell_, " steepest ", Chance(0.5) ? 90 : 60);
  if (Chance(0.15)) text += Text(" time_increment ", 0.049 / (samples + 1));
  return text + " )";
}

std::string WorldText::Ranger(double reach) {
  std::string text = Text(" ranger( alwayson 1 size [", Chance(0.5) ? 0 : reach, " ", reach,
                          " 0.1]", LocalPose(reach, 0.1 * Below(6)));
  if (Chance(0.3)) text += Text(" update_interval ", 50 * (1 + Below(6)));
  if (Chance(0.2)) text += Polygon(reach);
  const uint32_t sensors = 1 + Below(3);
  for (uint32_t i = 0; i < sensors; i++) text += Sensor();
  return text + " )";
}

std::string WorldText::Robot(uint32_t number) {
  const double sizes[] = {0.4, 1, 2.5, 5, 12, 25, 140};
  const double size = OneOf(sizes) * cell_;
  const double reach = std::min(size, 20 * cell_);
  const char* drives[] = {"diff", "omni", "car"};
  const double fast = 100 * cell_;
  std::string text = Text("position( name \"r", number, "\" alwayson 1 drive \"", OneOf(drives),
                          "\" velocity_bounds [", -fast, " ", fast, " ", -fast, " ", fast,
                          " 0 0 -400 400]", Pose(0.1 * Below(4)), Body(size));
  if (Chance(0.2)) text += " stack_children 0";
  if (Chance(0.3)) text += " localization \"odom\"";
  const uint32_t rangers = 1 + Below(2);
  for (uint32_t i = 0; i < rangers; i++) text += Ranger(reach);
  if (Chance(0.3)) {
    // Add a tower, which may have a ranger, and may be transparent for other rangers.
    text += Text(" model(", LocalPose(reach, 0), " ranger_return ",
                 Return(static_cast<int>(Below(3)) - 1), Body(reach),
                 Chance(0.5) ? Ranger(reach) : "", " )");
  }
  return text + " )\n";
}

// ---- changes ------------------------------------------------------------------------------------

namespace {

/// All models except for the ground, parents before their children.
std::vector<Model*> AllModels(Stg::World* world) {
  std::vector<Model*> models = all_models::InTree(world);
  std::erase(models, world->GetGround());
  return models;
}

}  // namespace

void Driver::Attach(Stg::World* world) {
  world_ = world;
  for (Model* model : AllModels(world)) {
    if (!dynamic_cast<ModelPosition*>(model)) continue;
    model->AddCallback(Model::CB_UPDATE, UpdatePosition, this);
    if (early_) model->AddCallback(Model::CB_VELOCITY, PushSomebody, this);
  }
  world->AddUpdateCallback(UpdateWorld, this);
}

int Driver::UpdatePosition(Model* model, void* driver) {
  const Driver& self = *static_cast<Driver*>(driver);
  const uint64_t step = model->GetWorld()->GetUpdateCount();
  Stg::RandomStream random(Stg::Fnv1a(model->TokenStr()) ^ (self.seed_ << 32) ^ step / 4);
  auto* position = static_cast<ModelPosition*>(model);
  const double fast = 25 * self.cell_;
  if (random.Uniform() < 0.2)
    position->Stop();
  else
    position->SetSpeed(random.Uniform(-fast, fast), random.Uniform(-fast, fast),
                       random.Uniform(-5, 5));
  return 0;
}

int Driver::UpdateWorld(Stg::World* world, void* driver) {
  Driver& self = *static_cast<Driver*>(driver);
  self.random_.Seed(self.seed_ * 1000003 + world->GetUpdateCount());
  self.JumpHome();
  while (self.Chance(0.5)) self.ChangeSomething();
  return 0;
}

Model* Driver::Any() {
  const std::vector<Model*> models = AllModels(world_);
  return models.empty() ? nullptr : models[Below(models.size())];
}

Model* Driver::AnyAtTop() {
  std::vector<Model*> models = world_->GetChildren();
  std::erase(models, world_->GetGround());
  return models.empty() ? nullptr : models[Below(models.size())];
}

ModelRanger* Driver::AnyRanger() {
  std::vector<ModelRanger*> rangers;
  for (Model* model : AllModels(world_))
    if (auto* ranger = dynamic_cast<ModelRanger*>(model)) rangers.push_back(ranger);
  return rangers.empty() ? nullptr : rangers[Below(rangers.size())];
}

void Driver::ChangeSomething() {
  using Change = void (Driver::*)();
  const Change changes[] = {&Driver::Create,
                            &Driver::Delete,
                            &Driver::JumpAway,
                            &Driver::JumpAway,
                            &Driver::ChangeBody,
                            &Driver::ChangeVisibility,
                            &Driver::ChangeVisibility,
                            &Driver::ChangeSensor,
                            &Driver::ChangeSensor,
                            &Driver::ChangeParent,
                            &Driver::ChangeSubscription};
  (this->*changes[Below(std::size(changes))])();
}

/// Creates a robot with a ranger beside an existing model.
void Driver::Create() {
  const Model* near = AnyAtTop();
  if (!near) return;
  Stg::Pose pose = near->GetPose();
  pose.x += random_.Uniform(-30, 30) * cell_;
  pose.y += random_.Uniform(-30, 30) * cell_;
  Model* robot = world_->CreateModel(nullptr, "position");
  robot->SetGeom(Stg::Geom(Stg::Pose(), Stg::Size(6 * cell_, 4 * cell_, 0.5)));
  robot->SetPose(pose);
  robot->AddCallback(Model::CB_UPDATE, UpdatePosition, this);
  robot->Subscribe();
  auto* ranger = static_cast<ModelRanger*>(world_->CreateModel(robot, "ranger"));
  ModelRanger::Sensor sensor;
  sensor.range.max = 100 * cell_;
  sensor.sample_count = 9;
  sensor.fov = 2;
  ranger->GetSensorsMutable().push_back(sensor);
  ranger->Subscribe();
}

void Driver::Delete() {
  if (AllModels(world_).size() > 6) delete (Chance(0.5) ? AnyAtTop() : Any());
}

void Driver::JumpAway() {
  Model* model = AnyAtTop();
  if (!model) return;
  if (early_ && Chance(0.8)) {
    world_->Enqueue(0, Chance(0.5) ? 1 : world_->sim_interval, model, JumpEarly, this);
    return;
  }
  jumps_.push_back({model->TokenStr(), model->GetPose(), world_->GetUpdateCount() + 3});
  const double far = Chance(0.5) ? 1e5 : -1e5;
  // Jump along an axis, because rays take too long to cross the space in between diagonally.
  model->AddToPose(Chance(0.5) ? far : 0, 0, Chance(0.3) ? 0.2 : 0, Chance(0.3) ? M_PI / 4 : 0);
}

int Driver::JumpEarly(Model* model, void* driver) {
  const double cell = static_cast<Driver*>(driver)->cell_;
  model->AddToPose(5 * cell, 3 * cell, 0, 0.3);
  return 0;
}

int Driver::PushSomebody(Model* model, void* driver) {
  const Driver& self = *static_cast<Driver*>(driver);
  const std::vector<Model*> all = AllModels(self.world_);
  Stg::RandomStream random(Stg::Fnv1a(model->TokenStr()) + self.world_->GetUpdateCount());
  Model* other = all[static_cast<size_t>(random.Next() % all.size())];
  if (random.Uniform() < 0.1) other->AddToPose(4 * self.cell_, -2 * self.cell_, 0, 0.2);
  return 0;
}

void Driver::JumpHome() {
  for (const Jump& jump : jumps_) {
    if (jump.until != world_->GetUpdateCount()) continue;
    for (Model* model : AllModels(world_))
      if (model->TokenStr() == jump.name) model->SetPose(jump.home);
  }
}

void Driver::ChangeBody() {
  Model* model = Any();
  if (!model) return;
  if (Chance(0.3)) {
    model->ClearBlocks();
    if (Chance(0.8)) model->AddBlockRect(0, 0, 3 * cell_, 2 * cell_, 0.7);
  }
  Stg::Geom geom = model->GetGeom();
  geom.size.x = random_.Uniform(0, 20) * cell_;
  geom.size.z = random_.Uniform(0, 2);
  if (Chance(0.2)) geom.size.y = 0;
  model->SetGeom(geom);
}

void Driver::ChangeVisibility() {
  Model* model = Any();
  if (!model) return;
  const double returns[] = {-1, -1, 0, 0.7};
  const double value = returns[Below(4)];
  model->SetRangerReturn(returns_ == WorldText::Returns::kAny || value < 0 ? value
                                                                           : kUniformReturn);
  if (Chance(0.2)) model->SetObstacleReturn(Chance(0.5));
}

void Driver::ChangeSensor() {
  ModelRanger* ranger = AnyRanger();
  if (!ranger || ranger->GetSensors().empty()) return;
  std::vector<ModelRanger::Sensor>& sensors = ranger->GetSensorsMutable();
  ModelRanger::Sensor& sensor = sensors[Below(sensors.size())];
  const unsigned counts[] = {0, 1, 2, 33};
  sensor.sample_count = counts[Below(4)];
  sensor.fov = random_.Uniform(-4, 8);
  const Stg::RayModel models[] = {Stg::RayModel::kDefault, Stg::RayModel::kCell,
                                  Stg::RayModel::kExact};
  if (Chance(0.3)) sensor.ray_model = models[Below(3)];
  const double ranges[] = {0, 0.5 * cell_, 77 * cell_, 20000 * cell_, INFINITY};
  sensor.range.max = ranges[Below(5)];
  if (sensor.range.max > 1000 * cell_) sensor.sample_count = std::min(sensor.sample_count, 2u);
}

void Driver::ChangeParent() {
  Model* child = Any();
  Model* parent = Chance(0.3) ? nullptr : AnyAtTop();
  if (!child || child == parent || (parent && child->IsDescendent(parent))) return;
  child->SetParent(parent);
}

void Driver::ChangeSubscription() {
  ModelRanger* ranger = AnyRanger();
  if (!ranger) return;
  if (ranger->HasSubscribers() && Chance(0.7))
    ranger->Unsubscribe();
  else
    ranger->Subscribe();
}

// ---- runs ---------------------------------------------------------------------------------------

Quiet::Quiet() {
  std::fflush(stdout);
  saved_ = dup(STDOUT_FILENO);
  if (FILE* null = std::fopen("/dev/null", "w")) {
    dup2(fileno(null), STDOUT_FILENO);
    std::fclose(null);
  }
}

Quiet::~Quiet() {
  std::fflush(stdout);
  dup2(saved_, STDOUT_FILENO);
  close(saved_);
}

namespace {

void InitLibrary() {
  static const bool done = [] {
    Stg::Init(nullptr, nullptr);
    return true;
  }();
  EXPECT_TRUE(done);
}

/// Loads and steps a world. A failure is reported afterwards, because Quiet would discard it.
template <typename Load>
Outcome LoadAndStep(Load load, uint64_t steps, const Stg::RunOptions& options, Driver* driver) {
  InitLibrary();
  Stg::World::run_options = options;
  Outcome outcome;
  bool loaded = false;
  {
    const Quiet quiet;
    Stg::World world;
    loaded = load(&world);
    if (loaded && driver) driver->Attach(&world);
    outcome.hashes.push_back(world.StateHash());
    for (uint64_t i = 0; loaded && i < steps; i++) {
      world.Update();
      outcome.hashes.push_back(world.StateHash());
    }
    const Stg::RunStatistics& statistics = world.statistics();
    outcome.device_steps = statistics.device_steps;
    outcome.rays = statistics.trace.rays;
    outcome.hits = statistics.trace.potential_hits;
    outcome.resumed = statistics.trace.resumed;
    outcome.ranges_given = statistics.trace.ranges_given;
  }
  EXPECT_TRUE(loaded) << "the world can't be loaded";
  Stg::World::run_options = Stg::RunOptions();
  return outcome;
}

}  // namespace

Outcome RunWorld(const WorldText& text, const Stg::RunOptions& options, bool early) {
  Driver driver(text.seed(), text.resolution(), early, text.returns());
  const auto load = [&](Stg::World* world) {
    std::istringstream stream(text.text());
    return world->Load(stream);
  };
  return LoadAndStep(load, text.steps(), options, &driver);
}

Outcome RunFile(const std::string& path, uint64_t steps, const Stg::RunOptions& options) {
  const auto load = [&](Stg::World* world) { return world->Load(path); };
  return LoadAndStep(load, steps, options, nullptr);
}

}  // namespace random_world
