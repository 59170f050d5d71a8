// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/camera.hh"

#include <cmath>

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

/// Draws each pixel of the image at the place where the camera saw it.
void DrawCamera(const ModelCamera& camera, Painting* data) {
  const float* depth = camera.FrameDepth();
  const unsigned char* color = camera.FrameColor();
  if (!depth || !color) return;
  const PerspectiveCamera& lens = camera.getCamera();
  const double pitch = dtor(lens.pitch());
  const double sine = std::sin(pitch), cosine = std::cos(pitch);
  Painter painter(data);
  // A horizontal frame: x to the right of the camera, y ahead.
  painter.SetFrame(Pose(lens.x(), lens.y(), lens.z(), dtor(lens.yaw())));
  const int width = camera.getWidth(), height = camera.getHeight();
  const double half_width = std::tan(dtor(lens.horizFov()) / 2),
               half_height = std::tan(dtor(lens.vertFov()) / 2);
  const auto at = [&](int i, int j, double d) {
    const double x = (2.0 * i / width - 1) * half_width * d;
    const double y = (2.0 * j / height - 1) * half_height * d;
    return point3_t(x, d * sine + y * cosine, -d * cosine + y * sine);
  };
  for (int j = 0; j < height; j++)
    for (int i = 0; i < width; i++) {
      const size_t pixel =
          static_cast<size_t>(j) * static_cast<size_t>(width) + static_cast<size_t>(i);
      const double d = depth[pixel];
      if (!(d < lens.farClip())) continue;
      const unsigned char* c = color + 4 * pixel;
      painter.SetColor({c[0], c[1], c[2], 255});
      painter.Quad(at(i, j, d), at(i + 1, j, d), at(i + 1, j + 1, d), at(i, j + 1, d));
    }
}

void Draw(ModelCamera& camera, const Pose&, const DataFrame& frame) {
  if (frame.options[Show::kCamera]) DrawCamera(camera, frame.layers.data);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelCamera>({Show::kCamera}, Draw));

}  // namespace

}  // namespace Stg::draw
