// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/blobfinder.hh"

#include "gui/draw/model_pictures.hh"
#include "gui/draw/type_picture.hh"

namespace Stg::draw {

namespace {

using view::Show;

constexpr Rgba kRed = {255, 0, 0, 255};

/// Unit vectors of the view in world coordinates: right, up, and towards the viewer.
struct Screen {
  point3_t right, up, out;
};
Screen ScreenOf(const view::Projection& projection) {
  const view::Matrix& m = projection.modelview();
  return {point3_t(m[0], m[4], m[8]), point3_t(m[1], m[5], m[9]), point3_t(m[2], m[6], m[10])};
}

void DrawBlobs(const ModelBlobfinder& finder, const Pose& global,
               const view::Projection& projection, Painting* painting) {
  constexpr double kPixel = 0.025;                         // m
  constexpr double kLeft = -2.5, kDown = -1.5, kUp = 0.5;  // m from the finder
  const Screen screen = ScreenOf(projection);
  const auto at = [&](double column, double row, double out = 0) {
    const double x = column * kPixel, y = (finder.scan_height - row) * kPixel;
    return point3_t(kLeft + x * screen.right.x + y * screen.up.x + out * screen.out.x,
                    kDown + x * screen.right.y + y * screen.up.y + out * screen.out.y,
                    kUp + x * screen.right.z + y * screen.up.z + out * screen.out.z);
  };
  Painter painter(painting);
  painter.SetFrame(Pose(global.x, global.y, global.z, 0));
  const double w = finder.scan_width, h = finder.scan_height;
  painter.SetColor(kWhite);
  painter.Quad(at(0, 0), at(w, 0), at(w, h), at(0, h));
  for (const ModelBlobfinder::Blob& blob : finder.GetBlobs()) {
    painter.SetColor(ToRgba(blob.color).WithOpacity(1));
    painter.Quad(at(blob.left, blob.top), at(blob.right + 1.0, blob.top),
                 at(blob.right + 1.0, blob.bottom), at(blob.left, blob.bottom));
  }
  painter.SetColor(kRed);
  const point3_t corners[] = {at(0, 0, kPixel), at(w, 0, kPixel), at(w, h, kPixel),
                              at(0, h, kPixel)};
  for (size_t i = 0; i < 4; i++) painter.Line(corners[i], corners[(i + 1) % 4]);
}

void Draw(ModelBlobfinder& finder, const Pose& global, const DataFrame& frame) {
  if (frame.options[Show::kBlobfinder])
    DrawBlobs(finder, global, frame.projection, frame.layers.data);
}

[[maybe_unused]] const bool kRegistered =
    RegisterPicture(PictureOf<ModelBlobfinder>({Show::kBlobfinder}, Draw));

}  // namespace

}  // namespace Stg::draw
