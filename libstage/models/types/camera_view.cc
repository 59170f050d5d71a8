// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/camera_view.hh"

#include <algorithm>
#include <cmath>

#include "geometry/geometry.hh"
#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "models/state_exchange.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kMinZ = 0.1;    // m: lower limit of the height of a perspective camera when moved
constexpr double kMinScale = 1;  // pixels per metre
constexpr double kMinZoom = 1.1, kMaxZoom = 2.5, kZoomUnit = 25;  // per turn of the wheel
constexpr double kFarthestPan = 100;                              // m

/// Old files contain pitches that were converted to degrees twice.
double PitchFromFile(double pitch) { return pitch > 180 ? dtor(pitch) : pitch; }

}  // namespace

// ---- PerspectiveCamera --------------------------------------------------------------------------

PerspectiveCamera::PerspectiveCamera(void)
    : _z_near(0.2), _z_far(40), _horiz_fov(70), _vert_fov(70), _aspect(1) {
  _pitch = 70;
}

void PerspectiveCamera::strafe(double amount) {
  const SineCosine yaw = SinCos(dtor(_yaw));
  _x += amount * yaw.cosine;
  _y += amount * yaw.sine;
}

void PerspectiveCamera::forward(double amount) {
  const SineCosine yaw = SinCos(dtor(_yaw)), pitch = SinCos(dtor(_pitch));
  _x -= amount * yaw.sine * pitch.sine;
  _y += amount * yaw.cosine * pitch.sine;
  _z -= amount * pitch.cosine;
}

void PerspectiveCamera::setPose(double x, double y, double z) {
  _x = x;
  _y = y;
  _z = z;
}

void PerspectiveCamera::addPose(double x, double y, double z) {
  _x += x;
  _y += y;
  _z = std::max(_z + z, kMinZ);
}

void PerspectiveCamera::move(double x, double y, double z) {
  const double fraction = _z / 100.0;
  const point_t moved = Rotated(point_t(x, y), SinCos(dtor(_yaw)));
  _x += fraction * moved.x;
  _y += fraction * moved.y;
  _z += fraction * z;
}

void PerspectiveCamera::setFov(double horiz_fov, double vert_fov) {
  _horiz_fov = horiz_fov;
  _vert_fov = vert_fov;
}

void PerspectiveCamera::addPitch(double pitch) { _pitch = constrain(_pitch + pitch, 0, 180); }

void PerspectiveCamera::setClip(double near, double far) {
  _z_near = near;
  _z_far = far;
}

void PerspectiveCamera::reset() {
  _pitch = 70;
  _yaw = 0;
}

void PerspectiveCamera::Load(Worldfile* wf, int sec) {
  wf->ReadTuple(sec, "pcam_loc", 0, 3, "lll", &_x, &_y, &_z);
  double pitch = _pitch, yaw = _yaw;
  if (wf->ReadTuple(sec, "pcam_angle", 0, 2, "ff", &pitch, &yaw) > 0) {
    _pitch = PitchFromFile(pitch);
    _yaw = pitch > 180 ? dtor(yaw) : yaw;
  }
}

void PerspectiveCamera::ExchangeState(StateExchange& exchange) {
  exchange(_pitch, _yaw, _x, _y, _z, _z_near, _z_far, _horiz_fov, _vert_fov, _aspect);
}

void PerspectiveCamera::Save(Worldfile* wf, int sec) {
  wf->WriteTuple(sec, "pcam_loc", 0, 3, "lll", _x, _y, _z);
  wf->WriteTuple(sec, "pcam_angle", 0, 2, "ff", _pitch, _yaw);
}

// ---- OrthoCamera --------------------------------------------------------------------------------

void OrthoCamera::SetProjection(double, double, double, double) {}

void OrthoCamera::move(double x, double y) {
  // The floor is foreshortened when viewed at an angle.
  const double foreshortening = std::max(SinCos(dtor(_pitch)).cosine, 1e-9);
  const double right = x / _scale;
  const double away = constrain(y / (_scale * foreshortening), -kFarthestPan, kFarthestPan);
  const point_t moved = Rotated(point_t(right, away), SinCos(dtor(_yaw)));
  _x += moved.x;
  _y += moved.y;
}

void OrthoCamera::addPitch(double pitch) { _pitch = constrain(_pitch + pitch, 0, 90); }

void OrthoCamera::setPose(double x, double y) {
  _x = x;
  _y = y;
}

void OrthoCamera::scale(double amount, double shift_x, double h, double shift_y, double w) {
  const double factor = constrain(1 + std::fabs(amount) / kZoomUnit, kMinZoom, kMaxZoom);
  const double old = _scale;
  _scale = std::max(amount < 0 ? old * factor : old / factor, kMinScale);
  if (w <= 0 || h <= 0) return;
  // Zooms about the pointer: the point below it stays in place.
  const double x = shift_x - w / 2, y = h / 2 - shift_y;
  const double gain = 1 / old - 1 / _scale;
  const point_t moved = Rotated(point_t(x, y), SinCos(dtor(_yaw)));
  _x += gain * moved.x;
  _y += gain * moved.y;
}

void OrthoCamera::reset(void) { _pitch = _yaw = 0; }

void OrthoCamera::Load(Worldfile* wf, int sec) {
  wf->ReadTuple(sec, "center", 0, 2, "ff", &_x, &_y);
  wf->ReadTuple(sec, "rotate", 0, 2, "ff", &_pitch, &_yaw);
  setScale(wf->ReadFloat(sec, "scale", _scale));
}

void OrthoCamera::Save(Worldfile* wf, int sec) {
  wf->WriteTuple(sec, "center", 0, 2, "ff", _x, _y);
  wf->WriteTuple(sec, "rotate", 0, 2, "ff", _pitch, _yaw);
  wf->WriteFloat(sec, "scale", _scale);
}

}  // namespace Stg
