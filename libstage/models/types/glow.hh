// SPDX-License-Identifier: GPL-2.0-or-later
//
// The glow of a light in pictures: a disc on the floor in the colour of the light. The window and
// the browser page both use these rules.

#ifndef STAGE_MODELS_TYPES_GLOW_HH
#define STAGE_MODELS_TYPES_GLOW_HH

namespace Stg {
class LightSource;

/// Metres: where the light causes 4 W/m2, but at least twice the radius of its body, and at most
/// 2 m. Lights that are off or have no intensity do not glow: 0.
double GlowRadius(const LightSource& light);

/// The opacity of a glow at its middle and at half of its radius; it is 0 at its edge.
inline constexpr double kGlowMiddle = 0.6, kGlowHalf = 0.15;

}  // namespace Stg

#endif
