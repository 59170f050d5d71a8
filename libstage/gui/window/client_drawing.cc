// SPDX-License-Identifier: GPL-2.0-or-later
//
// Members of WorldGui that clients call from Visualizer::Visualize() while a frame is drawn.

#include <FL/gl.h>

#include "gui/window/window_state.hh"
#include "models/body.hh"

namespace Stg {

namespace {

void SetColor(const Color& color) { glColor4d(color.r, color.g, color.b, color.a); }

void DrawBox(const bounds3d_t& box, double turn_degrees, const Pose& place) {
  glPushMatrix();
  glTranslated(place.x, place.y, place.z);
  glRotated(turn_degrees, 0, 0, 1);
  for (const double z : {box.z.min, box.z.max}) {
    glBegin(GL_LINE_LOOP);
    glVertex3d(box.x.min, box.y.min, z);
    glVertex3d(box.x.max, box.y.min, z);
    glVertex3d(box.x.max, box.y.max, z);
    glVertex3d(box.x.min, box.y.max, z);
    glEnd();
  }
  glPopMatrix();
}

void DrawBoxes(const Model& model, const Pose& global) {
  Pose frame = global + model.GetGeom().pose;
  frame.z = global.z + model.GetGeom().pose.z;
  if (!model.body().empty()) {
    SetColor(model.GetColor());
    DrawBox(model.body().BoundingBox(), rtod(frame.a), frame);
  }
  for (const Model* child : model.GetChildren())
    DrawBoxes(*child, model.ChildGlobalPose(global, *child));
}

}  // namespace

void WorldGui::PushColor(Color col) {
  state_->colors.push_back(col);
  SetColor(col);
}

void WorldGui::PushColor(double r, double g, double b, double a) { PushColor(Color(r, g, b, a)); }

void WorldGui::PopColor() {
  std::vector<Color>& colors = state_->colors;
  if (!colors.empty()) colors.pop_back();
  if (!colors.empty()) SetColor(colors.back());
}

void WorldGui::DrawBoundingBoxTree() {
  for (const Model* model : World::children) DrawBoxes(*model, model->GetPose());
}

}  // namespace Stg
