// SPDX-License-Identifier: GPL-2.0-or-later
//
// The two views that a window can have: Visualizer::Visualize() gets one, and a ModelCamera has
// one. They hold numbers only; what they do to a picture is up to those who draw. Part of
// <stage.hh>.
//
// Angles are degrees. Pitch 0 looks straight down, 90 is horizontal; yaw 0 looks along +y.

#ifndef STAGE_MODELS_CAMERA_VIEW_HH
#define STAGE_MODELS_CAMERA_VIEW_HH

namespace Stg {

class StateExchange;
class Worldfile;

class Camera {
 public:
  Camera() : _pitch(0), _yaw(0), _x(0), _y(0), _z(0) {}
  virtual ~Camera() {}

  virtual void Draw(void) const = 0;
  virtual void SetProjection(void) const = 0;

  double yaw(void) const { return _yaw; }
  double pitch(void) const { return _pitch; }
  double x(void) const { return _x; }
  double y(void) const { return _y; }
  double z(void) const { return _z; }

  /// Sets pitch and yaw to their defaults.
  virtual void reset() = 0;
  virtual void Load(Worldfile* wf, int sec) = 0;

 protected:
  double _pitch, _yaw;
  double _x, _y, _z;
};

class PerspectiveCamera : public Camera {
 public:
  PerspectiveCamera(void);

  void Draw(void) const override {}
  void SetProjection(void) const override {}
  void update(void) {}

  /// To the right, metres.
  void strafe(double amount);
  /// In the direction of view, metres.
  void forward(double amount);
  void setPose(double x, double y, double z);
  /// The result is at least 0.1 m high.
  void addPose(double x, double y, double z);
  /// To the right, ahead (level) and up; as much the more as the camera is high.
  void move(double x, double y, double z);
  void setFov(double horiz_fov, double vert_fov);
  /// Width by height of the window.
  void setAspect(double aspect) { _aspect = aspect; }
  void setYaw(double yaw) { _yaw = yaw; }
  void addYaw(double yaw) { _yaw += yaw; }
  void setPitch(double pitch) { _pitch = pitch; }
  /// The result is cut to 0..180.
  void addPitch(double pitch);
  void scroll(double dy) { _z += dy; }
  void setClip(double near, double far);
  void reset() override;

  double horizFov(void) const { return _horiz_fov; }
  double vertFov(void) const { return _vert_fov; }
  double aspect(void) const { return _aspect; }
  double nearClip(void) const { return _z_near; }
  double farClip(void) const { return _z_far; }
  /// Metres from the value of a depth buffer, 0..1.
  double realDistance(double z_buf_val) const {
    return _z_near * _z_far / (_z_far - z_buf_val * (_z_far - _z_near));
  }

  /// Properties pcam_loc and pcam_angle.
  void Load(Worldfile* wf, int sec) override;
  void Save(Worldfile* wf, int sec);
  void ExchangeState(StateExchange& exchange);

 private:
  double _z_near, _z_far;
  double _horiz_fov, _vert_fov;
  double _aspect;
};

class OrthoCamera : public Camera {
 public:
  OrthoCamera(void) : _scale(15) {}

  void Draw(void) const override {}
  void SetProjection(void) const override {}
  virtual void SetProjection(double pixels_width, double pixels_height, double y_min, double y_max);

  /// By pixels of the picture.
  void move(double x, double y);
  void setYaw(double yaw) { _yaw = yaw; }
  void setPitch(double pitch) { _pitch = pitch; }
  void addYaw(double yaw) { _yaw += yaw; }
  /// The result is cut to 0..90.
  void addPitch(double pitch);
  /// Pixels per metre.
  void setScale(double scale) { _scale = scale; }
  void setPose(double x, double y);
  /// Zooms by the mouse wheel: (shift_x, shift_y) is the point of a window of w by h pixels that
  /// stays where it is.
  void scale(double scale, double shift_x = 0, double h = 0, double shift_y = 0, double w = 0);
  double scale() const { return _scale; }
  void reset(void) override;

  /// Properties center, rotate and scale.
  void Load(Worldfile* wf, int sec) override;
  void Save(Worldfile* wf, int sec);

 private:
  double _scale;
};

}  // namespace Stg

#endif
