// SPDX-License-Identifier: GPL-2.0-or-later
//
// Moves of models, and their properties in contacts.

#include <cmath>

#include "messages/report.hh"
#include "models/floor_friction.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/placement.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/warn_about.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

bool IsCoefficient(double f) { return f >= 0 && std::isfinite(f); }

}  // namespace

void Model::MoveTree() {
  WantedMove wanted;
  if (!GetWantedMove(&wanted)) return;
  host().PrepareMove();
  const Pose before = pose;
  pose = wanted.pose;
  Placement& placement = host().placement;
  placement.Propose(*this, true);
  stall = host().IsBlocked(*this, before, placement);
  if (stall) pose = before;
  EndMove(stall ? Velocity() : wanted.velocity);
  if (stall) return;
  placement.Commit();
  NoteOutlineChange();
}

void Model::NoteOutlineChange() { host().NoteOutlineChange(root); }

void Model::ForEachContact(const std::function<void(const ContactPoint&)>& f) const {
  host().ForEachContact(root, f);
}

void Model::SetFriction(double f) {
  if (!IsCoefficient(f)) return WarnAbout(*this, "refused the friction %f, expected 0 or more", f);
  friction = f;
  host().contacts_changed = true;
}

void Model::SetFloorFriction(double f) {
  if (std::isnan(f) || f == INFINITY)
    return WarnAbout(*this, "refused the floor friction %f, which is not finite", f);
  floor_friction_ = f < 0 ? -1 : f;
  host().contacts_changed = true;
}

double Model::GetFloorFriction() const {
  return floor_friction_ >= 0 ? floor_friction_ : UsualFloorFriction(drives_);
}

void Model::SetPushable(bool pushable) {
  pushable_ = pushable;
  host().contacts_changed = true;
}

void Model::LoadContacts() {
  friction = wf->ReadFloat(wf_entity, "friction", friction);
  CheckNotNegative(*wf, wf_entity, "friction", friction);
  pushable_ = wf->ReadInt(wf_entity, "pushable", pushable_) != 0;
  if (wf->PropertyExists(wf_entity, "floor_friction")) {
    floor_friction_ = wf->ReadFloat(wf_entity, "floor_friction", 0);
    CheckNotNegative(*wf, wf_entity, "floor_friction", floor_friction_);
  }
  host().contacts_changed = true;
}

/// Hashed only if they differ from the defaults.
void Model::ExchangeContacts(StateExchange& exchange) {
  const bool usual = !pushable_ && round_ == kRoundIfRegular && floor_friction_ < 0;
  if (exchange.hashing() && usual) return;
  const bool pushable_before = pushable_;
  const int8_t round_before = round_;
  const double floor_friction_before = floor_friction_;
  exchange(pushable_, round_, floor_friction_);
  if (!exchange.hashing() && !exchange.omits_readings()) {
    bool has_pose = pose_before_push_ != nullptr;
    exchange(has_pose);
    if (exchange.restoring() && has_pose != (pose_before_push_ != nullptr)) {
      pose_before_push_.reset(has_pose ? new Pose() : nullptr);
      host().contacts_changed = true;  // the next step makes the pose again
    }
    if (pose_before_push_) exchange(*pose_before_push_);
  }
  if (exchange.restoring() && (pushable_ != pushable_before || round_ != round_before ||
                               floor_friction_ != floor_friction_before))
    host().contacts_changed = true;
}

}  // namespace Stg
