// SPDX-License-Identifier: GPL-2.0-or-later
//
// The two models of contacts between bodies. Part of <stage.hh>.

#ifndef STAGE_MOTION_CONTACT_MODEL_HH
#define STAGE_MOTION_CONTACT_MODEL_HH

namespace Stg {

/// The thing that stops a body that moves.
enum class ContactModel {
  kDefault,   ///< the world's setting, or kOutlines if it has none
  kCells,     ///< a cell of the grid that another body's outline crosses; the whole move is refused
  kOutlines,  ///< the outline of another body: bodies touch, slide, turn, and push what is pushable
};

}  // namespace Stg

#endif
