// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelCamera: takes pictures of the scene, in colour and in depth. Part of <stage.hh>.
//
// It looks from its own position along its own heading. Bodies are opaque and in their flat colour,
// its own tree's bodies included: mount a camera above or outside of them. Needs no window.

#ifndef STAGE_MODELS_CAMERA_HH
#define STAGE_MODELS_CAMERA_HH

#include <memory>

#include "models/camera_view.hh"
#include "models/model.hh"

// As OpenGL has them, whose headers clients may include as well.
typedef float GLfloat;
typedef unsigned char GLubyte;

namespace Stg {

class ModelCamera : public Model {
 public:
  ModelCamera(World* world, Model* parent, const std::string& type);
  ~ModelCamera();

  void Load() override;
  /// Takes a picture: of the bodies as the last step left them.
  void Update() override;
  void Gather(internal::sensing::FanList*) override;

  /// Pixels.
  int getWidth(void) const { return width_; }
  int getHeight(void) const { return height_; }
  /// Lens and clipping planes, and the pose of the latest picture.
  const PerspectiveCamera& getCamera(void) const { return camera_; }

  // Null until the first picture. Pixel (i, j) is element i + j * width; i = 0 is at the left, and
  // j = 0 is the bottom row.

  /// Metres along the direction of view; the far clipping distance where there is nothing.
  const GLfloat* FrameDepth() const;
  /// Red, green, blue and opacity (always 255) of each pixel.
  const GLubyte* FrameColor() const;

  /// How the camera is mounted, degrees: down, and to the right.
  void setPitch(double pitch) { tilt_ = pitch; }
  void setYaw(double yaw) { pan_ = yaw; }
  double getTilt() const { return tilt_; }
  double getPan() const { return pan_; }

 protected:
  void ExchangeState(StateExchange& exchange) override;

 private:
  struct Picture;

  void LoadLens();
  void TakePicture();
  void DrawTree(const Model& mod, const Pose& global);
  void DrawBody(const Model& mod, const Pose& global);
  void DrawFloor();

  int width_, height_;
  double pan_, tilt_;
  PerspectiveCamera camera_;
  std::unique_ptr<Picture> picture_;
};

}  // namespace Stg

#endif
