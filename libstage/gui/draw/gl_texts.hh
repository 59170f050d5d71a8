// SPDX-License-Identifier: GPL-2.0-or-later
//
// Hands the text of gl_helpers.hh to the renderer. Clients do not include this header, so that
// names such as `draw` cannot clash with theirs.

#ifndef STAGE_GUI_DRAW_GL_TEXTS_HH
#define STAGE_GUI_DRAW_GL_TEXTS_HH

namespace Stg {

namespace draw {
class ScreenWriter;
}

namespace Gl {

/// Moves all text requested since the last call to the writer.
void MoveTextTo(draw::ScreenWriter* writer);

}  // namespace Gl
}  // namespace Stg

#endif
