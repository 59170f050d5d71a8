// SPDX-License-Identifier: GPL-2.0-or-later
//
// Mouse and arrow keys on the canvas.

#ifndef STAGE_GUI_WINDOW_POINTER_HH
#define STAGE_GUI_WINDOW_POINTER_HH

namespace Stg::internal::window {

struct WindowState;

/// Handles FLTK's events for the canvas. Positions are pixels from its left and top.
class Pointer {
 public:
  explicit Pointer(WindowState& state) : state_(state) {}

  /// Returns 1 if the event was used, as Fl_Widget::handle() does.
  int Handle(int event);

 private:
  enum class Drag { kNone, kView, kModels, kTurn };

  void Push(int button);
  void DragTo(int x, int y);
  void Release();
  void MoveTo(int x, int y);
  void Wheel(int notches);
  int Key(int key);

  void PanView(int dx, int dy);
  void TurnView(int dx, int dy);
  void MoveModels(int x, int y);
  void TurnModels(int pixels);
  void Zoom(int notches);

  WindowState& state_;
  Drag drag_ = Drag::kNone;
  bool moved_ = false;             // since the button was pressed
  bool clears_selection_ = false;  // a release without motion clears the selection
  int x_ = 0, y_ = 0;              // last position
};

}  // namespace Stg::internal::window

#endif
