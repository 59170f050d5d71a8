// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/pointer.hh"

#include <FL/Fl.H>

#include <algorithm>
#include <cstdlib>

#include "gui/window/window_state.hh"

namespace Stg::internal::window {

namespace {
constexpr double kTurnPerPixel = 0.05;      // rotation of models, radians
constexpr double kFlatPerPixel = 0.5;       // rotation of the flat camera, degrees
constexpr double kPerspectivePerPixel = 1;  // degrees
constexpr double kLift = 0.1;               // metres per notch of the wheel
constexpr double kStride = 0.5;             // metres per arrow key
constexpr int kArrow = 10;                  // pixels per arrow key
}  // namespace

int Pointer::Handle(int event) {
  switch (event) {
    case FL_PUSH:
      Push(Fl::event_button());
      return 1;
    case FL_DRAG:
      DragTo(Fl::event_x(), Fl::event_y());
      return 1;
    case FL_RELEASE:
      Release();
      return 1;
    case FL_MOVE:
      MoveTo(Fl::event_x(), Fl::event_y());
      return 1;
    case FL_MOUSEWHEEL:
      Wheel(Fl::event_dy());
      return 1;
    case FL_KEYBOARD:
      return Key(Fl::event_key());
    default:
      return 0;
  }
}

// ---- buttons ------------------------------------------------------------------------------------

void Pointer::Push(int button) {
  x_ = Fl::event_x();
  y_ = Fl::event_y();
  moved_ = clears_selection_ = false;
  drag_ = Drag::kNone;
  const bool control = Fl::event_state(FL_CTRL) != 0;
  if (button == FL_RIGHT_MOUSE || (button == FL_LEFT_MOUSE && control)) drag_ = Drag::kTurn;
  if (drag_ == Drag::kTurn || button != FL_LEFT_MOUSE || !state_.canvas->HasArea()) return;

  Selection& selection = state_.selection;
  const view::Projection projection = state_.canvas->Projection();
  const double x = x_ + 0.5, y = y_ + 0.5;  // the centre of the pixel
  Model* model = PickModel(state_.world, projection.LineOfSightAt(x, y));
  if (!model) model = PickSmallModel(state_.world, projection, x, y);
  if (!model)
    clears_selection_ = true;
  else if (Fl::event_state(FL_SHIFT))
    selection.Toggle(model);
  else if (!selection.Contains(model))
    selection.SelectOnly(model);
  else
    selection.SetLast(model);
  drag_ = model && selection.Contains(model) ? Drag::kModels : Drag::kView;
  state_.runner.RequestFrame(true);
}

void Pointer::DragTo(int x, int y) {
  const int dx = x - x_, dy = y - y_;
  if (dx == 0 && dy == 0) return;
  moved_ = true;
  if (drag_ == Drag::kView)
    PanView(dx, dy);
  else if (drag_ == Drag::kModels)
    MoveModels(x, y);
  else if (drag_ == Drag::kTurn && !state_.selection.empty())
    TurnModels(dx + dy);
  else if (drag_ == Drag::kTurn)
    TurnView(dx, dy);
  x_ = x;
  y_ = y;
  state_.runner.RequestFrame(true);
}

void Pointer::Release() {
  if (clears_selection_ && !moved_) {
    state_.selection.Clear();
    state_.runner.RequestFrame(true);
  }
  drag_ = Drag::kNone;
}

void Pointer::MoveTo(int x, int y) {
  const int dx = x - x_, dy = y - y_;
  x_ = x;
  y_ = y;
  if (dx == 0 && dy == 0) return;
  if (Fl::event_state(FL_CTRL))
    TurnView(dx, dy);
  else if (Fl::event_state(FL_ALT))
    PanView(dx, dy);
  else
    return;
  state_.runner.RequestFrame(true);
}

void Pointer::MoveModels(int x, int y) {
  if (!state_.canvas->HasArea()) return;
  const view::Projection projection = state_.canvas->Projection();
  const auto from = projection.FloorPoint(x_, y_), to = projection.FloorPoint(x, y);
  if (!from || !to) return;  // the pointer is above the horizon
  for (Model* model : state_.selection.models()) {
    Pose pose = model->GetPose();
    pose.x += to->x - from->x;
    pose.y += to->y - from->y;
    model->SetPose(pose);
  }
}

void Pointer::TurnModels(int pixels) {
  for (Model* model : state_.selection.models()) {
    Pose pose = model->GetPose();
    pose.a = normalize(pose.a + kTurnPerPixel * pixels);
    model->SetPose(pose);
  }
}

// ---- view ---------------------------------------------------------------------------------------

void Pointer::PanView(int dx, int dy) {
  if (state_.view.is_perspective())
    state_.view.perspective.move(-dx, dy, 0);
  else
    state_.view.flat.move(-dx, dy);
}

void Pointer::TurnView(int dx, int dy) {
  view::ViewState& view = state_.view;
  if (view.is_perspective()) {
    view.perspective.addYaw(-kPerspectivePerPixel * dx);
    view.perspective.addPitch(-kPerspectivePerPixel * dy);
  } else {
    view.flat.addYaw(-kFlatPerPixel * dx);
    view.flat.addPitch(-kFlatPerPixel * dy);
  }
}

void Pointer::Wheel(int notches) {
  if (notches == 0 || !state_.canvas->HasArea()) return;
  if (state_.view.is_perspective())
    state_.view.perspective.addPose(0, 0, kLift * notches);
  else
    Zoom(notches);
  state_.runner.RequestFrame(true);
}

/// Zooms while keeping the floor point under the pointer in place.
void Pointer::Zoom(int notches) {
  OrthoCamera& camera = state_.view.flat;
  const int x = Fl::event_x(), y = Fl::event_y();
  const auto before = state_.canvas->Projection().FloorPoint(x, y);
  camera.scale(notches);
  const auto after = state_.canvas->Projection().FloorPoint(x, y);
  if (before && after && camera.pitch() < 89)  // near the horizon the floor point moves too far
    camera.setPose(camera.x() + before->x - after->x, camera.y() + before->y - after->y);
}

int Pointer::Key(int key) {
  int right = 0, up = 0;
  if (key == FL_Left) right = -1;
  if (key == FL_Right) right = 1;
  if (key == FL_Up) up = 1;
  if (key == FL_Down) up = -1;
  if (right == 0 && up == 0) return 0;
  view::ViewState& view = state_.view;
  if (!view.is_perspective())
    view.flat.move(kArrow * right, kArrow * up);
  else if (right != 0)
    view.perspective.strafe(kStride * right);
  else
    view.perspective.forward(kStride * up);
  state_.runner.RequestFrame(true);
  return 1;
}

}  // namespace Stg::internal::window
