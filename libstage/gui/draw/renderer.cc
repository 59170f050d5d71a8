// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/renderer.hh"

#include <cstdio>
#include <unordered_map>

#include "gui/draw/cached_frame.hh"
#include "gui/draw/gl_helpers.hh"
#include "gui/draw/gl_program.hh"
#include "gui/draw/gl_texts.hh"
#include "gui/draw/screen_writer.hh"
#include "gui/draw/shaders.hh"
#include "gui/draw/stall_icon.hh"
#include "messages/report.hh"
#include "models/robot_marks.hh"
#include "models/visualizer.hh"

namespace Stg::draw {

namespace {

constexpr int kTextPixels = 12;
constexpr float kSky[] = {0.7f, 0.7f, 0.8f};

struct GpuShape {
  GlBuffer corners;  // faces, then edges, then the nose
  GLsizei faces = 0, edges = 0, nose = 0;
  std::weak_ptr<const Shape> shape;
};

/// The lists in the order of upload.
constexpr std::vector<Instance> BodyBatch::*kLists[] = {&BodyBatch::footprints, &BodyBatch::solid,
                                                        &BodyBatch::robots, &BodyBatch::translucent,
                                                        &BodyBatch::noses};

}  // namespace

class Renderer::Impl {
 public:
  bool Prepare(std::string* error);
  void Draw(const RenderScene& scene, const Hud& hud);
  void Forget();
  unsigned draw_calls() const { return draw_calls_; }
  std::size_t vertices() const { return vertices_; }

 private:
  enum class BodyPart { kFaces, kEdges, kNose };

  void Clear(const Frame& frame, bool keep);
  void DrawWorld(const Frame& frame);
  void DrawOverlay(const Frame& frame, const Hud& hud);
  void DrawFloor(const Frame& frame);
  void CollectInstances(const Frame& frame);
  void DrawBodies(const Frame& frame, const std::vector<Instance> BodyBatch::*list, BodyPart part,
                  float height, float brightness);
  void DrawSolidBodies(const Frame& frame, const std::vector<Instance> BodyBatch::*list);
  void DrawRobots(const Frame& frame);
  void DrawAxisNumbers(const Frame& frame);
  void DrawTranslucentBodies(const Frame& frame);
  void DrawDots(const Frame& frame);
  void DrawPart(const GpuShape& shape, BodyPart part, GLsizei count);
  void DrawPainting(const Painting& painting);
  void DrawVertices(const std::vector<Vertex>& vertices, GLenum mode);
  void DrawFans(const Frame& frame);
  void DrawVisuals(const Frame& frame);
  void DrawStallIcons(const Frame& frame);
  void DrawScreen(const Frame& frame);
  void SendTips(const std::vector<RayEnd>& ray_ends);
  void SendAtlas();
  GpuShape& Upload(const std::shared_ptr<const Shape>& shape);
  void DropOldShapes();
  void CountCall(std::size_t vertices) {
    draw_calls_++;
    vertices_ += vertices;
  }

  bool ready_ = false, failed_ = false;
  std::string error_;
  GLuint arrays_ = 0, atlas_ = 0, tip_texture_ = 0;
  unsigned atlas_version_ = 0;
  GlProgram body_, plain_, fan_, floor_, text_;
  GlBuffer stream_, instances_, ray_ends_;
  std::unordered_map<uint64_t, GpuShape> shapes_;
  std::vector<Instance> all_instances_;
  std::vector<Vertex> icons_;
  Font font_;
  ScreenWriter writer_{&font_};
  unsigned draw_calls_ = 0, frames_ = 0;
  std::size_t vertices_ = 0;
  CachedFrame cached_frame_;
  view::Matrix last_view_{};
};

// ---- set-up -------------------------------------------------------------------------------------

bool Renderer::Impl::Prepare(std::string* error) {
  if (ready_) return true;
  if (failed_) {
    *error = error_;
    return false;
  }
  failed_ = true;
  const auto* version = reinterpret_cast<const char*>(glGetString(GL_VERSION));
  GLint major = 0, minor = 0;
  if (version) {
    glGetIntegerv(GL_MAJOR_VERSION, &major);
    glGetIntegerv(GL_MINOR_VERSION, &minor);
  }
  if (major * 10 + minor < 33)
    error_ = std::string("found OpenGL ") + (version ? version : "not at all") +
             ", expected 3.3 or later; install a newer driver, or Mesa for software rendering";
  else if (body_.Build("bodies", kBodyVertex, kColorFragment, &error_) &&
           plain_.Build("lines", kPlainVertex, kColorFragment, &error_) &&
           fan_.Build("fans", kFanVertex, kColorFragment, &error_) &&
           floor_.Build("the floor", kFloorVertex, kFloorFragment, &error_) &&
           text_.Build("texts", kTextVertex, kTextFragment, &error_))
    ready_ = true;
  *error = error_;
  if (!ready_) return false;
  failed_ = false;
  glGenVertexArrays(1, &arrays_);
  if (!font_.is_open() && !font_.Open(kTextPixels, error)) messages::Warn(*error);
  atlas_version_ = 0;
  return true;
}

void Renderer::Impl::Forget() {
  cached_frame_.Forget();
  stream_ = instances_ = ray_ends_ = GlBuffer();
  body_ = plain_ = fan_ = floor_ = text_ = GlProgram();
  arrays_ = atlas_ = tip_texture_ = 0;
  shapes_.clear();
  ready_ = failed_ = false;
}

// ---- bodies -------------------------------------------------------------------------------------

GpuShape& Renderer::Impl::Upload(const std::shared_ptr<const Shape>& shape) {
  GpuShape& gpu = shapes_[shape->id];
  if (gpu.corners.id() != 0) return gpu;
  gpu.shape = shape;
  gpu.faces = static_cast<GLsizei>(shape->faces.size());
  gpu.edges = static_cast<GLsizei>(shape->edges.size());
  gpu.nose = static_cast<GLsizei>(shape->nose.size());
  std::vector<Corner> corners = shape->faces;
  corners.insert(corners.end(), shape->edges.begin(), shape->edges.end());
  corners.insert(corners.end(), shape->nose.begin(), shape->nose.end());
  gpu.corners.Fill(GL_ARRAY_BUFFER, corners.data(), corners.size() * sizeof(Corner),
                   GL_STATIC_DRAW);
  return gpu;
}

void Renderer::Impl::DropOldShapes() {
  for (auto entry = shapes_.begin(); entry != shapes_.end();) {
    if (!entry->second.shape.expired()) {
      ++entry;
      continue;
    }
    entry->second.corners.Delete();
    entry = shapes_.erase(entry);
  }
}

/// Uploads all instances at once: for each batch, its lists one after the other.
void Renderer::Impl::CollectInstances(const Frame& frame) {
  all_instances_.clear();
  for (const BodyBatch& batch : frame.bodies)
    for (const auto list : kLists)
      all_instances_.insert(all_instances_.end(), (batch.*list).begin(), (batch.*list).end());
  instances_.Fill(GL_ARRAY_BUFFER, all_instances_.data(), all_instances_.size() * sizeof(Instance));
}

void Renderer::Impl::DrawBodies(const Frame& frame, const std::vector<Instance> BodyBatch::*list,
                                BodyPart part, float height, float brightness) {
  body_.Use();
  body_.SetMatrix(frame.projection->world_to_clip());
  body_.Set("height", height);
  body_.Set("brightness", brightness);
  std::size_t first = 0;
  for (const BodyBatch& batch : frame.bodies) {
    std::size_t place = first;
    for (const auto l : kLists) {
      if (l == list) place = first;
      first += (batch.*l).size();
    }
    const auto count = static_cast<GLsizei>((batch.*list).size());
    if (count == 0) continue;
    const point3_t middle(frame.camera().x(), frame.camera().y(), 0);
    if (part == BodyPart::kEdges && !frame.is_perspective &&
        2 * batch.shape->reach < kEdgeWidth * frame.projection->PixelAt(middle))
      continue;
    GpuShape& shape = Upload(batch.shape);
    shape.corners.Bind(GL_ARRAY_BUFFER);
    DescribeAttribute(kCorner, 3, GL_FLOAT, sizeof(Corner), 0);
    instances_.Bind(GL_ARRAY_BUFFER);
    DescribeAttribute(kPlace, 4, GL_FLOAT, sizeof(Instance), place * sizeof(Instance), 1);
    DescribeAttribute(kColor, 4, GL_UNSIGNED_BYTE, sizeof(Instance),
                      place * sizeof(Instance) + offsetof(Instance, color), 1);
    DrawPart(shape, part, count);
  }
  DisableAttributes();
}

void Renderer::Impl::DrawPart(const GpuShape& shape, BodyPart part, GLsizei count) {
  const GLint first = part == BodyPart::kFaces   ? 0
                      : part == BodyPart::kEdges ? shape.faces
                                                 : shape.faces + shape.edges;
  const GLsizei corners = part == BodyPart::kFaces   ? shape.faces
                          : part == BodyPart::kEdges ? shape.edges
                                                     : shape.nose;
  glDrawArraysInstanced(part == BodyPart::kEdges ? GL_LINES : GL_TRIANGLES, first, corners, count);
  CountCall(static_cast<std::size_t>(corners) * static_cast<std::size_t>(count));
}

void Renderer::Impl::DrawSolidBodies(const Frame& frame,
                                     const std::vector<Instance> BodyBatch::*list) {
  glEnable(GL_POLYGON_OFFSET_FILL);  // pushes faces behind their edges
  glPolygonOffset(1, 1);
  DrawBodies(frame, list, BodyPart::kFaces, 1, 1);
  glDisable(GL_POLYGON_OFFSET_FILL);
  DrawBodies(frame, list, BodyPart::kEdges, 1, 0.5f);
}

void Renderer::Impl::DrawRobots(const Frame& frame) {
  DrawSolidBodies(frame, &BodyBatch::robots);
  DrawBodies(frame, &BodyBatch::noses, BodyPart::kNose, 1, 1);
}

/// Draws axis numbers above the scenery and dots. Robots of normal size are drawn later and hide
/// them.
void Renderer::Impl::DrawAxisNumbers(const Frame& frame) {
  glDisable(GL_DEPTH_TEST);
  writer_.AddAxisNumbers(frame.floor, *frame.projection);
  DrawScreen(frame);
  glEnable(GL_DEPTH_TEST);
}

/// In the view from straight above, no wall may hide a dot, even if it overlaps one.
void Renderer::Impl::DrawDots(const Frame& frame) {
  if (frame.dots.empty()) return;
  plain_.Use();
  plain_.SetMatrix(frame.projection->world_to_clip());
  if (!frame.is_perspective && frame.flat.pitch() == 0) glDisable(GL_DEPTH_TEST);
  glPointSize(frame.dot_width);
  DrawVertices(frame.dots, GL_POINTS);
  glEnable(GL_DEPTH_TEST);
}

void Renderer::Impl::DrawTranslucentBodies(const Frame& frame) {
  DrawBodies(frame, &BodyBatch::translucent, BodyPart::kFaces, 1, 1);
  DrawBodies(frame, &BodyBatch::translucent, BodyPart::kEdges, 1, 0.5f);
}

// ---- scene content ------------------------------------------------------------------------------

void Renderer::Impl::DrawVertices(const std::vector<Vertex>& vertices, GLenum mode) {
  if (vertices.empty()) return;
  stream_.Fill(GL_ARRAY_BUFFER, vertices.data(), vertices.size() * sizeof(Vertex));
  DescribeAttribute(kCorner, 3, GL_FLOAT, sizeof(Vertex), 0);
  DescribeAttribute(kColor, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offsetof(Vertex, color));
  glDrawArrays(mode, 0, static_cast<GLsizei>(vertices.size()));
  CountCall(vertices.size());
  DisableAttributes();
}

void Renderer::Impl::DrawPainting(const Painting& painting) {
  DrawVertices(painting.triangles, GL_TRIANGLES);
  DrawVertices(painting.lines, GL_LINES);
  glLineWidth(2);
  DrawVertices(painting.thick_lines, GL_LINES);
  glLineWidth(1);
  glPointSize(4);
  DrawVertices(painting.points, GL_POINTS);
}

void Renderer::Impl::DrawFloor(const Frame& frame) {
  const auto x0 = static_cast<float>(frame.floor_x.min), x1 = static_cast<float>(frame.floor_x.max);
  const auto y0 = static_cast<float>(frame.floor_y.min), y1 = static_cast<float>(frame.floor_y.max);
  if (!(x1 > x0 && y1 > y0)) return;
  const Corner corners[] = {{x0, y0, 0}, {x1, y0, 0}, {x0, y1, 0}, {x1, y1, 0}};
  floor_.Use();
  floor_.SetMatrix(frame.projection->world_to_clip());
  floor_.Set("checked", frame.checked_floor ? 1.0f : 0.0f);
  stream_.Fill(GL_ARRAY_BUFFER, corners, sizeof corners);
  DescribeAttribute(kCorner, 3, GL_FLOAT, sizeof(Corner), 0);
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  CountCall(4);
  DisableAttributes();
}

void Renderer::Impl::SendTips(const std::vector<RayEnd>& ray_ends) {
  ray_ends_.Fill(GL_TEXTURE_BUFFER, ray_ends.data(), ray_ends.size() * sizeof(RayEnd));
  if (tip_texture_ == 0) glGenTextures(1, &tip_texture_);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_BUFFER, tip_texture_);
  glTexBuffer(GL_TEXTURE_BUFFER, GL_RG32F, ray_ends_.id());
}

void Renderer::Impl::DrawFans(const Frame& frame) {
  if (frame.ray_ends.empty()) return;
  fan_.Use();
  fan_.SetMatrix(frame.projection->world_to_clip());
  fan_.Set("tips", 0);
  SendTips(frame.ray_ends);
  for (const FanGroup& group : frame.fans) {
    if (group.fans.empty()) continue;
    stream_.Fill(GL_ARRAY_BUFFER, group.fans.data(), group.fans.size() * sizeof(FanInstance));
    constexpr std::size_t kStride = sizeof(FanInstance);
    DescribeAttribute(kCorner, 4, GL_FLOAT, kStride, 0, 1);
    DescribeAttribute(kPlace, 1, GL_UNSIGNED_INT, kStride, offsetof(FanInstance, first), 1);
    DescribeAttribute(kColor, 4, GL_UNSIGNED_BYTE, kStride, offsetof(FanInstance, color), 1);
    glDrawArraysInstanced(GL_TRIANGLE_FAN, 0, static_cast<GLsizei>(group.ray_ends + 1),
                          static_cast<GLsizei>(group.fans.size()));
    CountCall((group.ray_ends + 1) * group.fans.size());
  }
  DisableAttributes();
  glBindTexture(GL_TEXTURE_BUFFER, 0);
}

/// Calls the clients' visualizers, which draw with OpenGL 1 in the model's frame.
void Renderer::Impl::DrawVisuals(const Frame& frame) {
  if (frame.visuals.empty()) return;
  glUseProgram(0);
  glBindVertexArray(0);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
  glPushAttrib(GL_ALL_ATTRIB_BITS);
  glPushClientAttrib(static_cast<GLbitfield>(GL_CLIENT_ALL_ATTRIB_BITS));
  glMatrixMode(GL_PROJECTION);
  glPushMatrix();
  glLoadMatrixd(frame.projection->projection().data());
  glMatrixMode(GL_MODELVIEW);
  glPushMatrix();
  for (const ClientVisual& visual : frame.visuals) {
    glMatrixMode(GL_MODELVIEW);
    glLoadMatrixd(frame.projection->modelview().data());
    Gl::pose_shift(visual.frame);
    // Visualize() may change its camera, so each visualizer gets a fresh copy.
    OrthoCamera flat = frame.flat;
    PerspectiveCamera perspective = frame.perspective;
    Camera* camera = frame.is_perspective ? static_cast<Camera*>(&perspective) : &flat;
    visual.visualizer->Visualize(visual.model, camera);
  }
  glMatrixMode(GL_MODELVIEW);
  glPopMatrix();
  glMatrixMode(GL_PROJECTION);
  glPopMatrix();
  glMatrixMode(GL_MODELVIEW);
  glPopClientAttrib();
  glPopAttrib();
  glBindVertexArray(arrays_);
}

void Renderer::Impl::DrawStallIcons(const Frame& frame) {
  icons_.clear();
  for (const point3_t& place : frame.stalled)
    AppendStallIcon(place, frame.projection->modelview(), &icons_);
  DrawVertices(icons_, GL_TRIANGLES);
}

// ---- overlay ------------------------------------------------------------------------------------

void Renderer::Impl::SendAtlas() {
  if (atlas_ != 0 && atlas_version_ == font_.atlas_version()) return;
  atlas_version_ = font_.atlas_version();
  if (atlas_ == 0) glGenTextures(1, &atlas_);
  glBindTexture(GL_TEXTURE_2D, atlas_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, Font::kAtlasSide, Font::kAtlasSide, 0, GL_RED,
               GL_UNSIGNED_BYTE, font_.atlas().data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
}

/// Draws the writer's triangles and clears them.
void Renderer::Impl::DrawScreen(const Frame& frame) {
  const std::vector<TextVertex>& vertices = writer_.vertices();
  if (vertices.empty()) return;
  glActiveTexture(GL_TEXTURE0);
  if (font_.is_open()) SendAtlas();
  glBindTexture(GL_TEXTURE_2D, atlas_);
  text_.Use();
  text_.Set("canvas", static_cast<float>(frame.projection->width()),
            static_cast<float>(frame.projection->height()));
  text_.Set("atlas", 0);
  stream_.Fill(GL_ARRAY_BUFFER, vertices.data(), vertices.size() * sizeof(TextVertex));
  DescribeAttribute(kCorner, 4, GL_FLOAT, sizeof(TextVertex), 0);
  DescribeAttribute(kColor, 4, GL_UNSIGNED_BYTE, sizeof(TextVertex), offsetof(TextVertex, color));
  glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size()));
  CountCall(vertices.size());
  DisableAttributes();
  glBindTexture(GL_TEXTURE_2D, 0);
  writer_.Clear();
}

// ---- frame --------------------------------------------------------------------------------------

void Renderer::Impl::Clear(const Frame& frame, bool keep) {
  glViewport(0, 0, frame.projection->width(), frame.projection->height());
  glClearColor(kSky[0], kSky[1], kSky[2], 1);
  glDepthMask(GL_TRUE);
  glClear(keep ? GL_DEPTH_BUFFER_BIT : GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthFunc(GL_LEQUAL);
  if (keep) return;  // the floor stays below the trails of earlier frames
  DrawFloor(frame);
  plain_.Use();
  plain_.SetMatrix(frame.projection->world_to_clip());
  DrawPainting(frame.floor);
}

void Renderer::Impl::DrawWorld(const Frame& frame) {
  CollectInstances(frame);
  DrawBodies(frame, &BodyBatch::footprints, BodyPart::kFaces, 0, 1);

  glEnable(GL_DEPTH_TEST);
  DrawSolidBodies(frame, &BodyBatch::solid);
  DrawDots(frame);
  DrawAxisNumbers(frame);
  DrawRobots(frame);
  plain_.Use();
  plain_.SetMatrix(frame.projection->world_to_clip());
  DrawPainting(frame.solid);
  DrawStallIcons(frame);
  glDepthMask(GL_FALSE);
  DrawTranslucentBodies(frame);
  plain_.Use();
  DrawPainting(frame.marks);
  DrawFans(frame);
  plain_.Use();
  DrawPainting(frame.data);
  glDepthMask(GL_TRUE);
  DrawVisuals(frame);
  glDisable(GL_DEPTH_TEST);
}

/// Draws everything that is never occluded.
void Renderer::Impl::DrawOverlay(const Frame& frame, const Hud& hud) {
  plain_.Use();
  DrawPainting(frame.over);
  writer_.AddLabels(frame.marks, *frame.projection);
  writer_.AddLabels(frame.over, *frame.projection);
  Gl::MoveTextTo(&writer_);
  for (std::size_t i = 0; i < frame.chart_count; i++) writer_.AddChart(frame.charts[i]);
  if (!hud.clock.empty()) writer_.AddClock(hud.clock);
  if (!hud.overlay.empty()) writer_.AddOverlay(hud.overlay, frame.projection->height());
  DrawScreen(frame);
}

void Renderer::Impl::Draw(const RenderScene& scene, const Hud& hud) {
  const Frame& frame = scene.frame();
  std::string error;
  if (!frame.projection || !Prepare(&error)) return;
  draw_calls_ = 0;
  vertices_ = 0;
  glPushAttrib(GL_ALL_ATTRIB_BITS);
  glBindVertexArray(arrays_);
  glDisable(GL_LIGHTING);
  glDisable(GL_CULL_FACE);
  if (++frames_ % 64 == 0) DropOldShapes();

  // Fast trails: earlier frames stay visible until the view changes.
  bool keep = false;
  if (frame.keep_last)
    keep = cached_frame_.Begin(frame.projection->width(), frame.projection->height()) &&
           last_view_ == frame.projection->world_to_clip();
  else
    cached_frame_.Delete();
  last_view_ = frame.projection->world_to_clip();
  Clear(frame, keep);
  DrawWorld(frame);
  if (frame.keep_last) cached_frame_.End();
  DrawOverlay(frame, hud);

  glUseProgram(0);
  glBindVertexArray(0);
  glBindBuffer(GL_ARRAY_BUFFER, 0);
  glBindBuffer(GL_TEXTURE_BUFFER, 0);
  glPopAttrib();
}

Renderer::Renderer() : impl_(std::make_unique<Impl>()) {}
Renderer::~Renderer() = default;
bool Renderer::Prepare(std::string* error) { return impl_->Prepare(error); }
void Renderer::Draw(const RenderScene& scene, const Hud& hud) { impl_->Draw(scene, hud); }
void Renderer::Forget() { impl_->Forget(); }
unsigned Renderer::draw_calls() const { return impl_->draw_calls(); }
std::size_t Renderer::vertices() const { return impl_->vertices(); }

}  // namespace Stg::draw
