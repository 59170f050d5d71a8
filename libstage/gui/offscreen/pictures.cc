// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/pictures.hh"

#include <algorithm>
#include <cmath>

#include "gui/draw/performance_overlay.hh"
#include "gui/draw/render_scene.hh"
#include "gui/draw/renderer.hh"
#include "gui/offscreen/context.hh"
#include "gui/offscreen/film.hh"
#include "gui/offscreen/png_writer.hh"
#include "models/visualizer.hh"
#include "world/engine.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg::offscreen {

namespace {

using view::Show;

constexpr int kDefaultWidth = 800, kDefaultHeight = 600;

/// A world without a window that keeps its models' visualizers.
class PictureWorld : public World {
 public:
  explicit PictureWorld(view::ViewState* view) : view_(*view) {}
  bool IsGUI() const override { return true; }
  void OfferVisualizer(Visualizer* visualizer, bool on_by_default) override {
    view_.options.Register(visualizer->GetMenuName(), visualizer->GetWorldfileName(),
                           on_by_default);
  }
  bool has_window_section() const { return has_window_section_; }

 protected:
  void LoadWindowSection() override { has_window_section_ = view_.Load(GetWorldFile()); }

 private:
  view::ViewState& view_;
  bool has_window_section_ = false;
};

/// Returns true if there is no problem; otherwise sets a one-line reason.
bool Report(int problem, const std::string& file, std::string* error) {
  if (problem != 0) *error = PngProblem(file, problem);
  return problem == 0;
}

class OffscreenPictures : public Pictures {
 public:
  explicit OffscreenPictures(const PictureOptions& picture_options) : options_(picture_options) {
    std::stable_sort(options_.shots.begin(), options_.shots.end(),
                     [](const auto& a, const auto& b) { return a.time < b.time; });
  }

  bool Check(std::string* error) {
    for (const PictureOptions::Shot& shot : options_.shots)
      if (!Report(TryWritePng(shot.file), shot.file, error)) return false;
    if (options_.film.empty()) return true;
    film_ = Film::Open(options_.film, error);
    return film_ != nullptr;
  }

  World* MakeWorld() override { return world_ = new PictureWorld(&view_); }

  bool Begin(std::string* error) override {
    ChooseSize();
    view_.options.OfferSwitchesFor(*world_);
    const bool trails = view_.options[Show::kFootprints] || view_.options[Show::kTrailArrows] ||
                        view_.options[Show::kTrailBlocks];
    world_->RecordTrails(trails);
    if (!view_.follow_model.empty()) selection_.last = world_->GetModel(view_.follow_model);
    context_ = Context::Make(width_, height_, error);
    return context_ && renderer_.Prepare(error);
  }

  bool Make(std::string* error) override {
    const usec_t now = world_->SimTimeNow();
    bool drawn = false;
    while (next_shot_ < options_.shots.size() && options_.shots[next_shot_].time <= now) {
      if (!drawn) Draw();
      drawn = true;
      const std::string& file = options_.shots[next_shot_++].file;
      if (!Report(WritePng(file, image_, IfExists::kReplace), file, error)) return false;
    }
    if (!film_ || !film_->IsDue(now)) return true;
    if (!drawn) Draw();
    return film_->Add(image_, now, world_->sim_interval, error);
  }

  bool End(bool interrupted, std::string* error) override {
    if (film_ && !film_->Finish(error)) return false;
    if (interrupted || next_shot_ == options_.shots.size()) return true;
    const PictureOptions::Shot& missed = options_.shots[next_shot_];
    char text[128];
    std::snprintf(text, sizeof text, " was not made: the run ended after %g s, before %g s",
                  static_cast<double>(world_->SimTimeNow()) / 1e6,
                  static_cast<double>(missed.time) / 1e6);
    *error = missed.file + text;
    return false;
  }

 private:
  /// An image of another size than the window's shows the same part of the world.
  void ChooseSize() {
    const bool sized = world_->has_window_section() && view_.width > 0 && view_.height > 0;
    const int window_width = sized ? view_.width : kDefaultWidth;
    const int window_height =
        sized ? std::max(1, view_.height - view::ViewState::kMenuHeight) : kDefaultHeight;
    width_ = options_.width > 0 ? options_.width : window_width;
    height_ = options_.height > 0 ? options_.height : window_height;
    if (!world_->has_window_section()) {
      ShowAll();
      return;
    }
    const double zoom = std::min(static_cast<double>(width_) / window_width,
                                 static_cast<double>(height_) / window_height);
    view_.flat.setScale(view_.flat.scale() * zoom);
  }

  void ShowAll() {
    Bounds x(0, 0), y(0, 0);
    for (const Model* model : world_->GetChildren()) {
      const Pose pose = model->GetGlobalPose();
      const Size size = model->GetGeom().size;
      x = Bounds(std::min(x.min, pose.x - size.x / 2), std::max(x.max, pose.x + size.x / 2));
      y = Bounds(std::min(y.min, pose.y - size.y / 2), std::max(y.max, pose.y + size.y / 2));
    }
    view_.ShowAll(x, y, width_, height_);
  }

  void Draw() {
    if (selection_.last) view_.Follow(selection_.last->GetGlobalPose());
    scene_.Update(*world_, view_, width_, height_, selection_);
    draw::Hud hud;
    if (view_.options[Show::kClock]) hud.clock = world_->ClockString();
    if (view_.options[Show::kOverlay]) {
      overlay_.Update(*world_, WallClock());
      hud.overlay = overlay_.lines();
    }
    context_->Bind();
    renderer_.Draw(scene_, hud);
    context_->Read(&image_);
  }

  PictureOptions options_;
  std::unique_ptr<Film> film_;
  size_t next_shot_ = 0;
  view::ViewState view_;
  PictureWorld* world_ = nullptr;
  draw::Selection selection_;
  int width_ = 0, height_ = 0;
  std::unique_ptr<Context> context_;
  draw::RenderScene scene_;
  draw::Renderer renderer_;
  draw::PerformanceOverlay overlay_;
  Image image_;
};

Pictures* Make(const PictureOptions& picture_options, std::string* error) {
  auto pictures = std::make_unique<OffscreenPictures>(picture_options);
  return pictures->Check(error) ? pictures.release() : nullptr;
}

}  // namespace

}  // namespace Stg::offscreen

extern "C" Stg::offscreen::Pictures* stage_make_pictures(
    const Stg::offscreen::PictureOptions& picture_options, std::string* error) {
  return Stg::offscreen::Make(picture_options, error);
}
static_assert(std::is_same_v<Stg::offscreen::MakePictures, decltype(&stage_make_pictures)>);
