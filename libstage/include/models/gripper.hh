// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelGripper: two fingers that close and a lift. Part of <stage.hh>.
//
// Two break beams run from finger to finger, and along each finger's inner face a contact strip.
// They notice models with a gripper_return. Only contacts while the fingers close grip.

#ifndef STAGE_MODELS_GRIPPER_HH
#define STAGE_MODELS_GRIPPER_HH

#include "models/model.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class ModelGripper : public Model, private internal::sensing::RaySink {
 public:
  typedef enum { PADDLE_OPEN = 0, PADDLE_CLOSED, PADDLE_OPENING, PADDLE_CLOSING } paddle_state_t;
  typedef enum { LIFT_DOWN = 0, LIFT_UP, LIFT_UPPING, LIFT_DOWNING } lift_state_t;
  typedef enum { CMD_NOOP = 0, CMD_OPEN, CMD_CLOSE, CMD_UP, CMD_DOWN } cmd_t;

  struct config_t {
    Size paddle_size;  ///< of a finger, as shares of the body's size
    paddle_state_t paddles;
    lift_state_t lift;
    double paddle_position;      ///< 0 open, 1 closed
    double lift_position;        ///< 0 down, 1 up
    Model* gripped;              ///< a child of the gripper while it is held
    bool paddles_stalled;        ///< something touches a finger
    double close_limit;          ///< what is gripped stops the fingers at this position
    bool autosnatch;             ///< closes by itself when a beam is broken
    double break_beam_inset[2];  ///< from the finger tips, as shares of the body's length
    Model* beam[2];              ///< what breaks the inner and the outer beam
    Model* contact[2];           ///< what touches the left and the right finger
  };

  ModelGripper(World* world, Model* parent, const std::string& type);
  ~ModelGripper();

  /// As of the last update.
  config_t GetConfig() { return config_; }
  /// All but what the gripper holds and senses. One with a number that is not finite is refused
  /// with a message.
  void SetConfig(config_t& newcfg);

  /// Obeyed from the next update on, until another one comes.
  void SetCommand(cmd_t cmd) { command_ = cmd; }
  void CommandOpen() { SetCommand(CMD_OPEN); }
  void CommandClose() { SetCommand(CMD_CLOSE); }
  void CommandUp() { SetCommand(CMD_UP); }
  void CommandDown() { SetCommand(CMD_DOWN); }

  using Model::Load;
  void Load() override;
  void Save() override;
  void RemoveChild(Model* mod) override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  /// Moves fingers and lift, and puts the beams into the batch of the step.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;
  /// Grips and drops, and draws the fingers where they are.
  void Sensed() override;

 private:
  void LoadConfig();
  void BuildBody();
  bool HasBody() const;
  void ShapeBody();
  bounds3d_t Finger(bool left) const;
  void ObeyCommand();
  void MovePaddles();
  void MoveLift();
  void AddRays(internal::sensing::FanList* fans);
  void AddRay(uint32_t tag, const Pose& local, double length, internal::sensing::FanList* fans);
  Model* Grippable() const;
  void Grip();
  void Drop();
  void TakeHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  config_t config_;
  cmd_t command_;
  bool drop_due_, shape_due_;
  unsigned body_made_;  // the group's count of clearings then: if it changed, the fingers are gone
  Model* hits_[4];      // of the beams, then the contacts
  uint32_t hit_ids_[4];
};

}  // namespace Stg

#endif
