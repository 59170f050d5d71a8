// SPDX-License-Identifier: GPL-2.0-or-later
//
// libFuzzer entry point: the bytes encode the actions of callbacks of every type in a small world
// with all types of models. Nothing may break, and one thread with separate rays must give the same
// results as two threads with ray batches.
//
// Bytes: two with a bit for each type of callback that is active; the number of steps; then, for
// each callback in order of the calls, an action and its arguments.
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "fuzz/two_ways.hh"
#include "stage.hh"

namespace {

using namespace Stg;

const char kWorld[] = R"(
resolution 0.05
model( name "wall" size [4 0.2 1] pose [0 2 0 0] fiducial_return 3 )
model( name "mat" size [1 1 0.1] pose [-1 0 0 0] joules -1 give_watts 50 alwayson 1 )
position( name "r" pose [-1 0 0 30] joules 100 take_watts 10 alwayson 1 velocity [0.4 0 0 20]
  ranger( name "l" alwayson 1 sensor( range [0 3] fov 180 samples 7 noise [0.01 0.01 1] ) )
  gripper( name "g" alwayson 1 autosnatch 1 )
  blinkenlight( name "b" period 200 ) )
model( name "disc" size [0.2 0.2 0.2] pose [-0.4 0.2 0 0] gripper_return 1 fiducial_return 2 )
position( name "s" pose [1 0 0 180] alwayson 1 velocity [0.3 0 0 -20]
  bumper( name "u" alwayson 1 bcount 2 ) fiducial( name "f" alwayson 1 range_max 4 )
  blobfinder( name "c" alwayson 1 image [8 8] range 3 ) camera( alwayson 1 resolution [4 4] ) )
actuator( name "a" pose [0 -2 0 0] alwayson 1 max_position 2 start_position 0.5
  wifi( name "w" alwayson 1 model "simple" ) lightindicator( name "i" intensity 1 )
  light( name "j" ) lightsensor( name "k" alwayson 1 noise [0.1 0.1] ) )
wifi( alwayson 1 model "simple" pose [1 1 0 0] )
)";
constexpr const char* kTypes[] = {
    "model",  "position", "ranger", "gripper",      "bumper",         "fiducial", "blobfinder",
    "camera", "actuator", "wifi",   "blinkenlight", "lightindicator", "light",    "lightsensor"};
constexpr size_t kMaxModels = 60;

/// One run, with the record of what happened.
class Run {
 public:
  Run(const uint8_t* data, size_t size) : data_(data), size_(size) {}

  uint64_t Go(bool plain, ContactModel contacts) {
    two_ways::Choose(plain, contacts);
    now_ = this;
    active_types_ = Next() | Next() << 8;
    const int steps = 1 + Next() % 8;
    world_ = new World;
    Load();
    for (int i = 0; i < steps && world_; i++) {
      Step();
      if (world_) CheckTree();
    }
    if (world_) Note(static_cast<double>(world_->StateHash() >> 12));
    delete world_;
    now_ = nullptr;
    return trace_.hash();
  }

  static int OnEvent(Model* model, void* type) {
    return now_ ? now_->Act(model, reinterpret_cast<uintptr_t>(type)) : 0;
  }
  static int OnStep(World*, void*) { return now_ ? now_->Act(nullptr, kWorldCallback) : 0; }
  static int Drive(Model* model, void*) {
    static_cast<ModelPosition*>(model)->SetTurnSpeed(model->GetPose().x);
    return 0;
  }
  /// Adds a callback of every type.
  static void Attach(Model* model) {
    for (int type = 0; type < Model::__CB_TYPE_COUNT; type++) AttachOne(model, type);
    if (now_ && (now_->active_types_ >> Model::CB_UPDATE & 1) == 0 &&
        dynamic_cast<ModelPosition*>(model))
      model->AddParallelCallback(Model::CB_UPDATE, Drive, nullptr);
  }

 private:
  static constexpr uintptr_t kWorldCallback = 14, kTimed = 15;

  static void* NumberAsPointer(uintptr_t number) {
    return reinterpret_cast<void*>(number);  // NOLINT(performance-no-int-to-ptr)
  }

  static void AttachOne(Model* model, int type) {
    if (now_ && (now_->active_types_ >> type & 1) != 0)
      model->AddCallback(static_cast<Model::callback_type_t>(type), OnEvent,
                         NumberAsPointer(static_cast<uintptr_t>(type)));
  }

  unsigned Next() { return at_ < size_ ? data_[at_++] : 0; }
  /// A length from -2 to 2 metres.
  double Length() { return (static_cast<int>(Next()) - 128) / 64.0; }
  void Note(double value) { trace_(value); }

  /// Steps the world; Update() passes on exceptions of callbacks.
  void Step() {
    try {
      world_->Update();
    } catch (int number) {
      Note(number);
    }
  }

  void Load() {
    std::istringstream text(kWorld);
    const bool loaded = world_->Load(text);
    if (!world_) return;
    Note(loaded);
    if (active_types_ >> kWorldCallback & 1) world_->AddUpdateCallback(OnStep, nullptr);
  }

  /// All models except the ground, parents before children.
  std::vector<Model*> Models() {
    std::vector<Model*> all;
    const auto add = [&](const auto& self, const Ancestor& above) -> void {
      for (Model* child : above.GetChildren()) {
        if (child == world_->GetGround()) continue;
        all.push_back(child);
        self(self, *child);
      }
    };
    add(add, *world_);
    return all;
  }

  Model* Pick() {
    const std::vector<Model*> all = Models();
    return all.empty() ? nullptr : all[Next() % all.size()];
  }

  void CheckTree() {
    two_ways::CheckValid(*world_);
    const std::vector<Model*> all = Models();
    two_ways::Check(world_->GetAllModels().size() == all.size() + 1, "all models are in the tree");
    for (const Model* model : all) {
      two_ways::Check(Model::LookupId(model->GetId()) == model,
                      "models are found by their numbers");
      two_ways::Check(model->GetWorld() == world_, "models are in their world");
      const Model* top = model;
      while (top->Parent()) top = top->Parent();
      two_ways::Check(model->Root() == top, "the root is at the top");
      two_ways::Check(model->Depth() <= Model::kMaxDepth, "models are not too deep");
    }
  }

  int Act(Model* model, uintptr_t type) {
    if (!world_ || at_ >= size_) return 0;
    Note(static_cast<double>(type));
    const unsigned action = Next();
    const int result = action >= 128;  // 1: remove the callback
    if (type == Model::CB_INIT && action == 77) throw 42;
    if (action % 64 < 12)
      ChangeWorld(action % 64);
    else if (Model* other = action & 1 && model ? model : Pick())
      ChangeModel(other, action % 64);
    return result;
  }

  void ChangeWorld(unsigned action) {
    switch (action) {
      case 0:
        return;
      case 1:
        return world_->Reload();
      case 2:
        world_->Save("/nonexistent/folder/x.world");
        return;
      case 3:
        return world_->UnLoad();
      case 4:
        return Load();
      case 5:
        return Delete();
      case 6:
        world_->Update();
        return;
      case 7:
        World::UpdateAll();
        return;
      case 8:
        return Create(nullptr);
      case 9:
        world_->AddUpdateCallback(OnStep, reinterpret_cast<void*>(1));
        return;
      case 10:
        Note(world_->RemoveUpdateCallback(OnStep, nullptr));
        return;
      default:
        return Look();
    }
  }

  void Delete() {
    World* world = world_;
    world_ = nullptr;
    delete world;
  }

  void Create(Model* parent) {
    if (world_->GetAllModels().size() > kMaxModels) return;
    Model* made = world_->CreateModel(parent, kTypes[Next() % std::size(kTypes)]);
    if (made) made->SetPose(Pose(Length(), Length(), 0, Length()));
  }

  void Look() {
    const auto any = [](Model*, const Model*, const void*) { return true; };
    const Pose from(Length(), Length(), 0.1, Length());
    Note(world_->Raytrace(from, 4, any, nullptr, nullptr, Next() & 1).range);
  }

  void ChangeModel(Model* model, unsigned action) {
    static Model::Flag flag(Color::red, 0.2);
    switch (action / 2) {
      case 6:
        delete model;
        return;
      case 7:
        Note(model->SetParent(Pick()));
        return;
      case 8:
        Note(model->SetParent(nullptr));
        return;
      case 9:
        return model->BecomeParentOf(Pick());
      case 10:
        return Create(model);
      case 11:
        return model->Subscribe();
      case 12:
        return model->Unsubscribe();
      case 13:
        return model->SetPose(Pose(Length(), Length(), 0, Length()));
      case 14:
        return model->SetGlobalPose(Pose(Length(), Length(), 0, Length()));
      case 15:
        return model->SetGeom(Geom(Pose(), Size(Length(), Length(), 0.5)));
      case 16:
        return model->AddBlockRect(Length(), Length(), 0.5, 0.5, 0.5);
      case 17:
        return model->ClearBlocks();
      case 18:
        return model->PushFlag(&flag);
      case 19:
        Note(model->PopFlag() != nullptr);
        return;
      case 20:
        Note(model->RandomPoseInFreeSpace(-2, 2, -2, 2, 5));
        return;
      case 21:
        return model->Load();
      case 22:
        return model->Save();
      case 23:
        Note(model->CallCallbacks(
            static_cast<Model::callback_type_t>(Next() % Model::__CB_TYPE_COUNT)));
        return;
      case 24:
        return model->InitControllers();
      case 25:
        return model->SetRangerReturn(Length());
      case 26:
        return world_->Enqueue(0, Next() * 2000, model, OnEvent, NumberAsPointer(kTimed));
      case 27:
        Note(model->RemoveCallback(
            static_cast<Model::callback_type_t>(Next() % Model::__CB_TYPE_COUNT), OnEvent));
        return;
      case 28:
        return AttachOne(model, static_cast<int>(Next() % Model::__CB_TYPE_COUNT));
      case 29:
        return model->SetToken("name" + std::to_string(Next() % 4));
      default:
        return Command(model);
    }
  }

  void Command(Model* model) {
    if (auto* position = dynamic_cast<ModelPosition*>(model)) {
      if (Next() & 1)
        position->SetVelocity(Velocity(Length(), Length(), 0, Length()));
      else
        position->SetSpeed(Length(), 0, Length());
    } else if (auto* gripper = dynamic_cast<ModelGripper*>(model)) {
      gripper->SetCommand(static_cast<ModelGripper::cmd_t>(Next() % 5));
    } else if (auto* actuator = dynamic_cast<ModelActuator*>(model)) {
      actuator->GoTo(Length());
    } else if (auto* ranger = dynamic_cast<ModelRanger*>(model)) {
      ranger->GetSensorsMutable().resize(Next() % 4);
    }
  }

  static Run* now_;
  const uint8_t* data_;
  size_t size_, at_ = 0;
  unsigned active_types_ = 0;
  World* world_ = nullptr;
  const std::vector<Model*> no_models_;
  StateExchange trace_{no_models_};
};

Run* Run::now_ = nullptr;

/// Adds callbacks to models on creation, so that some are called while the world is loaded.
void WrapCreators() {
  static std::map<std::string, creator_t>& plain = *new std::map<std::string, creator_t>;
  if (!plain.empty()) return;
  plain = Model::name_map;
  for (auto& [type, creator] : Model::name_map)
    creator = [](World* world, Model* parent, const std::string& of_type) {
      Model* model = plain[of_type](world, parent, of_type);
      Run::Attach(model);
      return model;
    };
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 300) return 0;
  two_ways::Choose(true);
  WrapCreators();
  for (const auto contacts : {ContactModel::kCells, ContactModel::kOutlines})
    two_ways::Check(Run(data, size).Go(true, contacts) == Run(data, size).Go(false, contacts),
                    "both ways come out the same");
  return 0;
}
