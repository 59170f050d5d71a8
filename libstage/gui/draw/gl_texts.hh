// SPDX-License-Identifier: GPL-2.0-or-later
//
// The texts of gl_helpers.hh, for those who finish pictures. Clients don't see this header: names
// of ours such as `draw` would get in their way.

#ifndef STAGE_GUI_DRAW_GL_TEXTS_HH
#define STAGE_GUI_DRAW_GL_TEXTS_HH

namespace Stg {

namespace draw {
class ScreenWriter;
}

namespace Gl {

/// Moves the texts that were drawn since the last call to the writer.
void TakeTexts(draw::ScreenWriter* writer);

}  // namespace Gl
}  // namespace Stg

#endif
