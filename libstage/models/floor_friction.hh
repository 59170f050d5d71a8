// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_FLOOR_FRICTION_HH
#define STAGE_MODELS_FLOOR_FRICTION_HH

namespace Stg {

/// Coefficient of friction with the floor of a model without floor_friction: of rubber wheels, or
/// of a box of wood or cardboard.
constexpr double UsualFloorFriction(bool drives) { return drives ? 0.8 : 0.5; }

}  // namespace Stg

#endif
