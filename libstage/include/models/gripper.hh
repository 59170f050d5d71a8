// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelGripper: two closing fingers (paddles) and a lift. Part of <stage.hh>.
//
// Two break beams run between the fingers, and a contact strip along each finger's inner face. They
// detect models with gripper_return. Objects are gripped only on contact while closing.

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
    Size paddle_size;  ///< finger size as fractions of the body's size
    paddle_state_t paddles;
    lift_state_t lift;
    double paddle_position;      ///< 0 open, 1 closed
    double lift_position;        ///< 0 down, 1 up
    Model* gripped;              ///< a child of the gripper while held
    bool paddles_stalled;        ///< an object touches a finger
    double close_limit;          ///< finger position at which the held object blocks
    bool autosnatch;             ///< closes automatically if a beam is broken
    double break_beam_inset[2];  ///< from the finger tips, as fractions of the body's length
    Model* beam[2];              ///< models that break the inner and the outer beam
    Model* contact[2];           ///< models that touch the left and the right finger
  };

  ModelGripper(World* world, Model* parent, const std::string& type);
  ~ModelGripper();

  /// Configuration and state as of the last update.
  config_t GetConfig() { return config_; }
  /// Sets all members except those for held and sensed objects. Refused with a message if a number
  /// is not finite.
  void SetConfig(config_t& newcfg);

  /// Takes effect at the next update and stays in force until replaced.
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
  /// Moves fingers and lift, and adds the rays to the batch of the step.
  void Update() override;
  void Gather(internal::sensing::FanList* fans) override;
  /// Grips or drops, and rasterizes the fingers again.
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
  void ReceiveHits(uint32_t tag, const internal::sensing::RayHits& hits) override;

  config_t config_;
  cmd_t command_;
  bool drop_due_, shape_due_;
  unsigned body_made_;  // times_cleared() at BuildBody(): if it differs, the fingers are gone
  Model* hits_[4];      // two beams, then two contacts
  uint32_t hit_ids_[4];
};

}  // namespace Stg

#endif
