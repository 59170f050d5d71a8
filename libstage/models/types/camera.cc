// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/camera.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/camera_raster.hh"
#include "pictures/color_byte.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr int kMaxSidePixels = 16384;    // pixels
constexpr int kMaxPixels = 4096 * 2304;  // in total
constexpr camera::Rgba kFloor{255, 255, 255, 255};

/// True if a picture may have these sides.
bool IsPossible(int width, int height) {
  return width >= 0 && height >= 0 && width <= kMaxSidePixels && height <= kMaxSidePixels &&
         width * height <= kMaxPixels;
}

camera::Rgba Opaque(const Color& color) {
  return {ColorByte(color.r), ColorByte(color.g), ColorByte(color.b), 255};
}

/// Tangent of half a field of view given in degrees.
double HalfTangent(double fov) {
  const SineCosine half = SinCos(dtor(fov) / 2);
  return half.sine / half.cosine;
}

double PlanarLength(const Pose& p) { return std::sqrt(p.x * p.x + p.y * p.y); }

/// Radius of a circle around the model's origin that contains the bodies of it and its descendants.
double TreeRadius(const Model& mod) {
  double radius = PlanarLength(mod.GetGeom().pose) + mod.body().radius();
  for (const Model* child : mod.GetChildren()) {
    const double reach = PlanarLength(child->GetPose()) + TreeRadius(*child);
    if (reach > radius) radius = reach;
  }
  return radius;
}

void Describe(const ModelCamera& camera, SensorExtent* extent) {
  extent->pixels =
      static_cast<uint64_t>(camera.getWidth()) * static_cast<uint64_t>(camera.getHeight());
}

ReadingShape ShapeOfDepth(const ModelCamera& camera) {
  return ReadingShape(static_cast<size_t>(camera.getHeight()),
                      static_cast<size_t>(camera.getWidth()));
}
ReadingShape ShapeOfColor(const ModelCamera& camera) {
  const ReadingShape size = ShapeOfDepth(camera);
  return ReadingShape(size.lengths[0], size.lengths[1], 3);
}

/// Calls copy(first, width) with the index of the first pixel of each of the upper `rows` rows,
/// from the top: the camera's rows are bottom up.
template <typename F>
void ForEachRow(const ModelCamera& camera, size_t rows, F copy) {
  const ReadingShape size = ShapeOfDepth(camera);
  for (size_t row = 0; row < rows; row++)
    copy((size.lengths[0] - 1 - row) * size.lengths[1], size.lengths[1]);
}

bool CopyDepth(const ModelCamera& camera, size_t rows, float* to) {
  const GLfloat* const depth = camera.FrameDepth();
  if (!depth) return false;
  ForEachRow(camera, rows,
             [&](size_t first, size_t width) { to = std::copy_n(depth + first, width, to); });
  return true;
}

bool CopyColor(const ModelCamera& camera, size_t rows, uint8_t* to) {
  const GLubyte* const color = camera.FrameColor();
  if (!color) return false;
  ForEachRow(camera, rows, [&](size_t first, size_t width) {
    for (const GLubyte* pixel = color + 4 * first; width > 0; width--, pixel += 4)
      to = std::copy_n(pixel, 3, to);
  });
  return true;
}

}  // namespace

ModelType CameraType() {
  return ModelTypeOf<ModelCamera>("camera")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel)
      .Senses(Describe)
      .Measurable()
      .Reads(MakeReading("color", "", "Red, green and blue, 0 to 255, the top row first.",
                         ShapeOfColor, CopyColor))
      .Reads(MakeReading("depth", "m",
                         "Depth along the viewing direction, the top row first; the far clipping "
                         "distance where nothing is seen.",
                         ShapeOfDepth, CopyDepth));
}

struct ModelCamera::Picture {
  std::vector<GLfloat> depth;
  std::vector<camera::Rgba> color;
  std::vector<point_t> floor;
  camera::Raster raster;
};

ModelCamera::ModelCamera(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      width_(32),
      height_(32),
      pan_(0),
      tilt_(0),
      picture_(std::make_unique<Picture>()) {
  camera_.setFov(70, 40);
  camera_.setClip(0.2, 8.0);
  camera_.setPitch(90);
  color = Color(0, 0, 0);
  geom.size = Size(0.1, 0.07, 0.05);
  blockgroup->Fit(geom.size);
}

ModelCamera::~ModelCamera() = default;

void ModelCamera::Load() {
  if (!LoadCommon()) return;
  wf->ReadTuple(wf_entity, "resolution", 0, 2, "ii", &width_, &height_);
  if (!IsPossible(width_, height_))
    wf->Fail(wf_entity, "resolution",
             "found " + std::to_string(width_) + " by " + std::to_string(height_) +
                 " pixels, expected numbers from 0 to " + std::to_string(kMaxSidePixels) +
                 ", and at most " + std::to_string(kMaxPixels) + " pixels in all");
  host().memory.Take(*wf, wf_entity, "resolution",
                     static_cast<size_t>(width_) * static_cast<size_t>(height_),
                     MemoryBudget::kPixel, "pixels");
  wf->ReadTuple(wf_entity, "pantilt", 0, 2, "ff", &pan_, &tilt_);
  LoadLens();
}

void ModelCamera::LoadLens() {
  double near = camera_.nearClip(), far = camera_.farClip();
  wf->ReadTuple(wf_entity, "range", 0, 2, "ll", &near, &far);
  if (!(near > 0 && near < far && std::isfinite(far)))
    wf->Fail(wf_entity, "range", "found invalid clipping planes, expected 0 < near < far");
  camera_.setClip(near, far);

  double horizontal = camera_.horizFov(), vertical = camera_.vertFov();
  wf->ReadTuple(wf_entity, "fov", 0, 2, "ff", &horizontal, &vertical);
  for (const double fov : {horizontal, vertical})
    if (!(fov > 0 && fov < 180))
      wf->Fail(wf_entity, "fov",
               "found a field of view of " + std::to_string(fov) +
                   " degrees, expected more than 0 and less than 180");
  camera_.setFov(horizontal, vertical);
}

const GLfloat* ModelCamera::FrameDepth() const {
  return picture_->depth.empty() ? nullptr : picture_->depth.data();
}

const GLubyte* ModelCamera::FrameColor() const {
  return picture_->color.empty() ? nullptr : &picture_->color[0].r;
}

void ModelCamera::Update() {
  GatherSerially();
  Model::Update();
}

void ModelCamera::Gather(internal::sensing::FanList*) {
  if (width_ > 0 && height_ > 0) TakePicture();
}

void ModelCamera::TakePicture() {
  const size_t pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  picture_->depth.resize(pixels);
  picture_->color.resize(pixels);

  const Pose global = GetGlobalPose();
  camera_.setPose(global.x, global.y, global.z);
  camera_.setYaw(rtod(global.a) - 90.0 - pan_);
  camera_.setPitch(90.0 - tilt_);

  camera::Lens lens;
  lens.eye = Pose(global.x, global.y, global.z, global.a - dtor(pan_));
  lens.tilt = dtor(tilt_);
  lens.half_width = HalfTangent(camera_.horizFov());
  lens.half_height = HalfTangent(camera_.vertFov());
  lens.near = camera_.nearClip();
  lens.far = camera_.farClip();
  camera::Raster& raster = picture_->raster;
  raster.Begin(lens, width_, height_, picture_->depth.data(), picture_->color.data());
  for (const Model* mod : world_base().GetChildren()) DrawTree(*mod, mod->GetPose());
  DrawFloor();  // last, so that flat bodies on the floor stay visible
  raster.Finish();
}

void ModelCamera::DrawTree(const Model& mod, const Pose& global) {
  if (!picture_->raster.MayShow(global.x, global.y, TreeRadius(mod))) return;
  if (!mod.body().empty()) DrawBody(mod, global);
  for (const Model* child : mod.GetChildren()) DrawTree(*child, child->GetGlobalPose());
}

void ModelCamera::DrawBody(const Model& mod, const Pose& global) {
  camera::Raster& raster = picture_->raster;
  const Pose frame = global + mod.GetGeom().pose;
  if (!raster.MayShow(frame.x, frame.y, mod.body().radius())) return;
  const camera::Rgba paint = Opaque(mod.GetShownColor());
  const auto& blocks = mod.body().blocks();
  for (size_t i = 0; i < blocks.size(); i++) {
    const Bounds& z = blocks[i]->z_range();
    raster.DrawWalls(blocks[i]->points(), frame, Bounds(z.min + frame.z, z.max + frame.z), paint);
  }
  // Bodies traced from pictures have holes, so adjacent blocks of equal height are filled together.
  const auto draw_level = [&](double Bounds::*end, auto visible) {
    for (size_t i = 0; i < blocks.size(); i++) {
      const double level = blocks[i]->z_range().*end + frame.z;
      if (!visible(level)) continue;
      raster.AddOutline(blocks[i]->points(), frame, level);
      const bool last = i + 1 == blocks.size();
      if (last || blocks[i + 1]->z_range().*end != blocks[i]->z_range().*end)
        raster.FillOutlines(level, paint);
    }
  };
  // Tops from below and bottoms from above are visible only from inside the body.
  const bool cut = raster.MayBeCut(frame.x, frame.y, mod.body().radius());
  draw_level(&Bounds::max,
             [&](double z) { return raster.IsBelowEye(z) || (cut && raster.IsAboveEye(z)); });
  draw_level(&Bounds::min,
             [&](double z) { return raster.IsAboveEye(z) || (cut && raster.IsBelowEye(z)); });
}

void ModelCamera::DrawFloor() {
  camera::Raster& raster = picture_->raster;
  const double level = 0.0;
  if (!raster.IsBelowEye(level) && !raster.IsAboveEye(level)) return;
  const bounds3d_t extent = scene().Extent();  // a copy, because other threads ask too
  const Bounds &x = extent.x, &y = extent.y;
  picture_->floor.assign({{x.min, y.min}, {x.max, y.min}, {x.max, y.max}, {x.min, y.max}});
  raster.AddOutline(picture_->floor, Pose(), level);
  raster.FillOutlines(level, kFloor);
}

void camera::Rgba::ExchangeState(StateExchange& exchange) { exchange(r, g, b, a); }

void ModelCamera::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(width_, height_, pan_, tilt_, camera_, picture_->depth, picture_->color);
  if (picture_->depth.size() != picture_->color.size())
    exchange.Fail("found a camera's picture with depth and color of different sizes");
  if (!IsPossible(width_, height_)) exchange.Fail("found a camera's picture that is too large");
}

}  // namespace Stg
