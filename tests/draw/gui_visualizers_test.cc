// SPDX-License-Identifier: GPL-2.0-or-later
//
// Clients' visualizers draw with OpenGL 1 in their model's frame.

#include <GL/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "gui/draw/gl_helpers.hh"
#include "gui/draw/render_scene.hh"
#include "gui/draw/renderer.hh"
#include "gui/offscreen/context.hh"
#include "support/model_testing.hh"

namespace Stg {

namespace {

constexpr int kSide = 200;  // pixels; 10 pixels per metre

/// Keeps visualizers, like a world with a window.
class DrawnWorld : public World {
 public:
  bool IsGUI() const override { return true; }
  void OfferVisualizer(Visualizer* visualizer, bool on) override {
    view.options.Register(visualizer->GetMenuName(), visualizer->GetWorldfileName(), on);
  }
  view::ViewState view;
};

/// A magenta square of 1 m, 2 m ahead of the model, and a word.
class Square : public Visualizer {
 public:
  Square() : Visualizer("square", "show_square") {}
  void Visualize(Model* model, Camera* camera) override {
    seen_model = model;
    seen_scale = dynamic_cast<OrthoCamera*>(camera) ? 1 : 0;
    glDisable(GL_DEPTH_TEST);  // the renderer must restore this
    glColor3f(1, 0, 1);
    Gl::draw_centered_rect(2, 0, 1, 1);
    glTranslatef(100, 100, 0);  // and this too
    if (say) Gl::draw_string(-100, -98, 0, "WWWW");
    if (!paragraph.empty())
      Gl::draw_string_multiline(-108, -108, 8, 8, paragraph.c_str(), alignment);
  }
  Model* seen_model = nullptr;
  double seen_scale = -1;
  bool say = false;
  std::string paragraph;
  unsigned alignment = 0;
};

class VisualizersTest : public testing::Test {
 protected:
  void SetUp() override {
    InitLibrary();
    std::string error;
    context_ = offscreen::Context::Make(kSide, kSide, &error);
    if (!context_) GTEST_SKIP() << error;
    world_ = std::make_unique<DrawnWorld>();
    std::istringstream text(
        "model ( name \"a\" pose [3 4 0 90] ) model ( name \"b\" pose [-3 -4 0 0] )");
    ASSERT_TRUE(world_->Load(text, "t.world"));
    world_->view.flat.setScale(10);
    world_->view.options.Set(view::Show::kData, true);
    for (const char* name : {"a", "b"}) {
      Find<>(*world_, name)->AddVisualizer(&square_, true);
      Find<>(*world_, name)->Subscribe();
    }
    Step(*world_, 1);
  }

  void Draw() {
    scene_.Update(*world_, world_->view, kSide, kSide);
    context_->Bind();
    renderer_.Draw(scene_, draw::Hud());
    context_->Read(&image_);
  }
  /// True if the picture is magenta at a point, metres.
  bool IsMagenta(double x, double y) const {
    const auto column = static_cast<size_t>(kSide / 2.0 + 10 * x);
    const auto row = static_cast<size_t>(kSide / 2.0 - 10 * y);
    const uint8_t* p = &image_.pixels[4 * (row * kSide + column)];
    return p[0] > 250 && p[1] < 5 && p[2] > 250;
  }

  /// Extent of a paragraph's letters: first and last column and row (from the bottom) of the pixels
  /// that differ from a picture without text; empty if none differ.
  struct Place {
    int left = kSide, right = -1, bottom = kSide, top = -1;
    bool empty() const { return right < left; }
  };
  Place PlaceOf(const std::string& text, unsigned alignment) {
    square_.paragraph.clear();
    Draw();
    const std::vector<uint8_t> before = image_.pixels;
    square_.paragraph = text;
    square_.alignment = alignment;
    Draw();
    Place place;
    for (int row = 0; row < kSide; row++)
      for (int column = 0; column < kSide; column++) {
        const auto at = 4 * (static_cast<size_t>(row) * kSide + static_cast<size_t>(column));
        if (std::equal(&before[at], &before[at] + 4, &image_.pixels[at])) continue;
        place.left = std::min(place.left, column);
        place.right = std::max(place.right, column);
        place.bottom = std::min(place.bottom, kSide - 1 - row);
        place.top = std::max(place.top, kSide - 1 - row);
      }
    return place;
  }

  std::unique_ptr<offscreen::Context> context_;
  std::unique_ptr<DrawnWorld> world_;
  Square square_;
  draw::RenderScene scene_;
  draw::Renderer renderer_;
  offscreen::Image image_;
};

TEST_F(VisualizersTest, DrawInTheModelsFrame) {
  Draw();
  EXPECT_TRUE(scene_.has_client_visuals());
  EXPECT_EQ(square_.seen_scale, 1);
  EXPECT_TRUE(IsMagenta(3.05, 6.05));    // ahead of a, which looks along +y
  EXPECT_TRUE(IsMagenta(-0.95, -3.95));  // ahead of b
  EXPECT_FALSE(IsMagenta(5, 4));
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
}

TEST_F(VisualizersTest, AreSwitchedByTheirOption) {
  const size_t option = world_->view.options.Register("square", "show_square", true);
  world_->view.options.Set(option, false);
  Draw();
  EXPECT_FALSE(scene_.has_client_visuals());
  EXPECT_FALSE(IsMagenta(3.05, 6.05));
  world_->view.options.Set(option, true);
  Find<>(*world_, "a")->RemoveVisualizer(&square_);
  Draw();
  EXPECT_FALSE(IsMagenta(3.05, 6.05));
  EXPECT_TRUE(IsMagenta(-0.95, -3.95));
}

TEST_F(VisualizersTest, TextsAreInThePicture) {
  Draw();
  const std::vector<uint8_t> before = image_.pixels;
  square_.say = true;
  Draw();
  EXPECT_NE(image_.pixels, before);
  square_.say = false;
  Draw();
  EXPECT_EQ(image_.pixels, before);
}

/// b stands at (3, 4); the box of 8 m (80 pixels) lies to the left of and below it.
TEST_F(VisualizersTest, ParagraphsAreAlignedInTheirBox) {
  constexpr unsigned kTop = 1, kBottom = 2, kLeft = 4, kRight = 8;  // of FLTK
  Find<>(*world_, "a")->RemoveVisualizer(&square_);
  Find<>(*world_, "b")->SetPose(Pose(3, 4, 0, 0));
  constexpr int kFrom = 100 - 50, kTo = kFrom + 80;  // 3 - 8 m
  constexpr int kLow = 100 - 40, kHigh = kLow + 80;
  if (PlaceOf("HH", kLeft).empty()) GTEST_SKIP() << "no font is installed";

  const Place low = PlaceOf("HH\nHH", kLeft | kBottom);
  EXPECT_NEAR(low.left, kFrom, 3);
  EXPECT_LT(low.right, kFrom + 40);
  EXPECT_NEAR(low.bottom, kLow, 6);
  EXPECT_LT(low.top, kLow + 40);
  EXPECT_GT(low.top - low.bottom, 16);  // two lines
  const Place high = PlaceOf("HH\nHH", kRight | kTop);
  EXPECT_NEAR(high.right, kTo, 3);
  EXPECT_GT(high.left, kFrom + 40);
  EXPECT_NEAR(high.top, kHigh, 6);
  EXPECT_GT(high.bottom, kLow + 40);
  const Place middle = PlaceOf("HH", 0);
  EXPECT_NEAR(middle.left + middle.right, kFrom + kTo, 5);
  EXPECT_NEAR(middle.bottom + middle.top, kLow + kHigh, 6);
}

TEST_F(VisualizersTest, ParagraphsAreWrappedOnlyOnRequest) {
  constexpr unsigned kLeft = 4, kWrap = 128;
  Find<>(*world_, "a")->RemoveVisualizer(&square_);
  Find<>(*world_, "b")->SetPose(Pose(3, 4, 0, 0));
  const std::string text = "HHHH HHHH HHHH";  // wider than 80 pixels
  const Place one = PlaceOf(text, kLeft), wrapped = PlaceOf(text, kLeft | kWrap);
  if (one.empty()) GTEST_SKIP() << "no font is installed";
  EXPECT_GT(one.right - one.left, 80);
  EXPECT_LT(one.top - one.bottom, 12);
  EXPECT_LE(wrapped.right - wrapped.left, 80);
  EXPECT_GT(wrapped.top - wrapped.bottom, 16);
  EXPECT_TRUE(PlaceOf("", kLeft).empty());
}

}  // namespace

}  // namespace Stg
