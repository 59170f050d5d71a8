// SPDX-License-Identifier: GPL-2.0-or-later
//
// Whether pools, batches and branches can step a world without a World object.

#ifndef STAGE_WORLDS_WHY_NOT_CLOSED_HH
#define STAGE_WORLDS_WHY_NOT_CLOSED_HH

#include <string>

namespace Stg {

class World;

/// Why copies of the world with the same subscribers need World objects, in words that follow
/// "because"; empty if they need none. Loads a copy unless the reason is obvious.
std::string WhyNotClosed(const World& world);

}  // namespace Stg

#endif
