// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/gui_testing.hh"

#include <FL/fl_draw.H>
#include <FL/x.H>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "support/patience.hh"

namespace gui_testing {

namespace {

constexpr int kSkipped = 77;  // exit status that ctest reports as skipped

std::unique_ptr<XServer> server;
std::unique_ptr<Hand> hand;

}  // namespace

Hand& TheHand() { return *hand; }
unsigned long WindowId(Fl_Window* window) { return fl_xid(window); }

unsigned PixelOf(Fl_Window* window, int x, int y) {
  window->make_current();
  uchar rgb[3] = {};
  fl_read_image(rgb, x, y, 1, 1);
  return static_cast<unsigned>(rgb[0] << 16 | rgb[1] << 8 | rgb[2]);
}

void WindowTest::TearDown() {
  world_.reset();
  if (hand) TheHand().MoveTo(5, 5);
}

void WindowTest::Open(const std::string& text) {
  world_ = std::make_unique<Stg::WorldGui>(400, 300, "test");
  std::istringstream content(text);
  ASSERT_TRUE(world_->Load(content));
  world_->Stop();
  TheHand().Focus(WindowId(world_.get()));
  Settle();
}

void WindowTest::OpenFile(const std::string& file) {
  world_ = std::make_unique<Stg::WorldGui>(400, 300, "test");
  ASSERT_TRUE(world_->Load(file));
  world_->Stop();
  TheHand().Focus(WindowId(world_.get()));
  Settle();
}

void WindowTest::Run(double seconds) {
  const double end = WallClock() + seconds;
  for (double left = seconds; left > 0; left = end - WallClock()) Fl::wait(left);
}

bool WindowTest::RunUntil(const std::function<bool()>& condition) {
  const double end = WallClock() + patience::kPatience;
  while (!condition() && WallClock() < end) Fl::wait(0.01);
  return condition();
}

void WindowTest::Settle() {
  XSync(fl_display, False);  // fetches all pending events from the server
  while (XPending(fl_display)) Fl::wait(0);
  Run(0.03);  // a redraw may be scheduled for later
  RunUntil([this] { return !world_ || !canvas().shown() || !canvas().damage(); });
}

void WindowTest::Type(const std::string& key, const std::vector<std::string>& held) {
  TheHand().Type(key, held);
  Settle();
}

void WindowTest::MoveTo(double x, double y) {
  TheHand().MoveTo(world_->x_root() + canvas().x() + static_cast<int>(std::lround(x)),
                   world_->y_root() + canvas().y() + static_cast<int>(std::lround(y)));
  Settle();
}

void WindowTest::Click(double x, double y, int button) {
  MoveTo(x, y);
  TheHand().Click(button);
  Settle();
}

void WindowTest::DragBy(double x, double y, int dx, int dy, int button) {
  MoveTo(x, y);
  TheHand().Press(button);
  Settle();
  constexpr int kParts = 5;
  for (int i = 1; i <= kParts; i++) MoveTo(x + 1.0 * dx * i / kParts, y + 1.0 * dy * i / kParts);
  TheHand().Release(button);
  Settle();
}

Stg::point_t WindowTest::PlaceOf(const Stg::Pose& pose) {
  const auto pixels = canvas().Projection().ToPixels({pose.x, pose.y, pose.z});
  return {pixels->x, canvas().h() - pixels->y};
}

}  // namespace gui_testing

int main(int argc, char* argv[]) {
  using namespace gui_testing;
  testing::InitGoogleTest(&argc, argv);
  if (GTEST_FLAG_GET(list_tests)) return RUN_ALL_TESTS();
  server = std::make_unique<XServer>();
  if (server->name().empty()) {
    std::printf("skipped: Xvfb is not installed or doesn't start\n");
    return kSkipped;
  }
  setenv("DISPLAY", server->name().c_str(), 1);
  hand = std::make_unique<Hand>(server->name());
  if (!hand->works() || !Stg::Canvas::WhyUnavailable().empty()) {
    std::printf("skipped: %s\n", !hand->works() ? "the display has no XTest extension"
                                                : Stg::Canvas::WhyUnavailable().c_str());
    return kSkipped;
  }
  Stg::Init(&argc, &argv);
  const int result = RUN_ALL_TESTS();
  hand.reset();
  fl_close_display();
  server.reset();
  return result;
}
