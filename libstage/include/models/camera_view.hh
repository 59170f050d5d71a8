// SPDX-License-Identifier: GPL-2.0-or-later
//
// View parameters of windows, passed to Visualizer::Visualize(), and of ModelCamera. They only hold
// numbers; renderers interpret them. Part of <stage.hh>.
//
// Angles are in degrees. Pitch 0 looks straight down, 90 is horizontal; yaw 0 looks along +y.

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

  /// Resets pitch and yaw to their defaults.
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

  /// Moves to the right, in metres.
  void strafe(double amount);
  /// Moves in the direction of view, in metres.
  void forward(double amount);
  void setPose(double x, double y, double z);
  /// Moves; the resulting height is at least 0.1 m.
  void addPose(double x, double y, double z);
  /// Moves right, ahead (horizontally) and up, by distances proportional to the height.
  void move(double x, double y, double z);
  void setFov(double horiz_fov, double vert_fov);
  /// Width / height of the window.
  void setAspect(double aspect) { _aspect = aspect; }
  void setYaw(double yaw) { _yaw = yaw; }
  void addYaw(double yaw) { _yaw += yaw; }
  void setPitch(double pitch) { _pitch = pitch; }
  /// Clamps the result to 0..180.
  void addPitch(double pitch);
  void scroll(double dy) { _z += dy; }
  void setClip(double near, double far);
  void reset() override;

  double horizFov(void) const { return _horiz_fov; }
  double vertFov(void) const { return _vert_fov; }
  double aspect(void) const { return _aspect; }
  double nearClip(void) const { return _z_near; }
  double farClip(void) const { return _z_far; }
  /// Converts a depth-buffer value in 0..1 to metres.
  double realDistance(double z_buf_val) const {
    return _z_near * _z_far / (_z_far - z_buf_val * (_z_far - _z_near));
  }

  /// Reads the properties pcam_loc and pcam_angle.
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

  /// Moves by pixels of the picture.
  void move(double x, double y);
  void setYaw(double yaw) { _yaw = yaw; }
  void setPitch(double pitch) { _pitch = pitch; }
  void addYaw(double yaw) { _yaw += yaw; }
  /// Clamps the result to 0..90.
  void addPitch(double pitch);
  /// In pixels per metre.
  void setScale(double scale) { _scale = scale; }
  void setPose(double x, double y);
  /// Zooms by the mouse wheel, keeping the point (shift_x, shift_y) of a window of w by h pixels in
  /// place.
  void scale(double scale, double shift_x = 0, double h = 0, double shift_y = 0, double w = 0);
  double scale() const { return _scale; }
  void reset(void) override;

  /// Reads the properties center, rotate and scale.
  void Load(Worldfile* wf, int sec) override;
  void Save(Worldfile* wf, int sec);

 private:
  double _scale;
};

}  // namespace Stg

#endif
