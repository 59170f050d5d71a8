// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/view/view_state.hh"

#include <algorithm>
#include <cmath>

#include "worldfile/worldfile.hh"

namespace Stg::view {

namespace {

constexpr double kEyeHeight = 0.2;  // height of a following perspective camera, m
constexpr double kFilled = 0.9;     // fraction of the canvas that ShowAll() fills
constexpr int kMaxPixels = 16384;   // maximum side of a window

int WindowSide(double pixels, int otherwise) {
  if (pixels < 0) return -1;
  if (!(pixels > 0)) return otherwise;
  return static_cast<int>(std::clamp(pixels, double{ViewState::kMinSize}, double{kMaxPixels}));
}

}  // namespace

const Camera& ViewState::camera() const {
  if (is_perspective()) return perspective;
  return flat;
}

Camera& ViewState::camera() {
  if (is_perspective()) return perspective;
  return flat;
}

void ViewState::Follow(const Pose& pose) {
  if (!is_perspective()) {
    flat.setPose(pose.x, pose.y);
    return;
  }
  perspective.setPose(pose.x, pose.y, pose.z + kEyeHeight);
  perspective.setYaw(rtod(pose.a) - 90);
}

void ViewState::ShowAll(const Bounds& x, const Bounds& y, int canvas_width, int canvas_height) {
  const double wide = std::max(x.max - x.min, 1e-3), high = std::max(y.max - y.min, 1e-3);
  flat.setPose(0.5 * (x.min + x.max), 0.5 * (y.min + y.max));
  flat.setScale(std::max(1.0, kFilled * std::min(canvas_width / wide, canvas_height / high)));
}

bool ViewState::Load(Worldfile* file) {
  const int entity = file->LookupEntity("window");
  if (entity < 0) return false;
  double wide = width, high = height;
  file->ReadTuple(entity, "size", 0, 2, "ff", &wide, &high);
  width = WindowSide(wide, width);
  height = WindowSide(high, height);
  flat.Load(file, entity);
  perspective.Load(file, entity);
  interval = std::clamp(file->ReadInt(entity, "interval", interval), 1, 3600000);
  screenshot_skip = std::max(1, file->ReadInt(entity, "screenshot_skip", screenshot_skip));
  follow_model = file->ReadString(entity, "follow_model", follow_model);
  options.Load(file, entity);
  return true;
}

void ViewState::Save(Worldfile* file) {
  const int entity = file->LookupEntity("window");
  if (entity < 0) return;
  file->WriteTuple(entity, "size", 0, 2, "ii", width, height);
  flat.Save(file, entity);
  perspective.Save(file, entity);
  file->WriteInt(entity, "interval", interval);
  options.Save(file, entity);
}

}  // namespace Stg::view
