// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelCamera: takes pictures of the scene in colour and depth. Part of <stage.hh>.
//
// The camera looks along its own heading. Bodies are opaque and flat-coloured, including those of
// its own tree: mount a camera above or outside of them. It works without a window.

#ifndef STAGE_MODELS_CAMERA_HH
#define STAGE_MODELS_CAMERA_HH

#include <memory>

#include "models/camera_view.hh"
#include "models/model.hh"

// Declared as in OpenGL, whose headers clients may also include.
typedef float GLfloat;
typedef unsigned char GLubyte;

namespace Stg {

class ModelCamera : public Model {
 public:
  ModelCamera(World* world, Model* parent, const std::string& type);
  ~ModelCamera();

  void Load() override;
  /// Takes a picture of the bodies at the end of the last step.
  void Update() override;
  void Gather(internal::sensing::FanList*) override;

  /// Picture size in pixels.
  int getWidth(void) const { return width_; }
  int getHeight(void) const { return height_; }
  /// Lens, clipping planes, and the pose of the latest picture.
  const PerspectiveCamera& getCamera(void) const { return camera_; }

  // Null before the first picture. Pixel (i, j) is element i + j * width, with i = 0 at the left
  // and j = 0 at the bottom.

  /// Metres along the direction of view; the far clipping distance if nothing is there.
  const GLfloat* FrameDepth() const;
  /// Red, green, blue and opacity (always 255) of each pixel.
  const GLubyte* FrameColor() const;

  /// Mounting angles in degrees: pitch down, yaw to the right.
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
