// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures the time to draw pictures: draw WORLD [--frames N] [--steps N] [--size WxH] [--data].
//
// Runs a world for some steps, then draws N frames of it without a display, with an untimed step
// before each. Prints median and 95th percentile in milliseconds of copying the scene, drawing it
// (until completion), and both. Needs libstagegui.

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "gui/draw/gl_program.hh"
#include "gui/draw/render_scene.hh"
#include "gui/draw/renderer.hh"
#include "gui/offscreen/context.hh"
#include "stage.hh"

namespace {

using Stg::view::Show;

struct Request {
  std::string world;
  int frames = 100, steps = 20, width = 1000, height = 800;
  bool data = false;
};

int Usage() {
  std::fputs("Usage: draw WORLD [--frames N] [--steps N] [--size WxH] [--data]\n", stderr);
  return 2;
}

bool ReadNumber(const char* text, int* number, const char** end) {
  const auto [rest, error] = std::from_chars(text, text + std::strlen(text), *number);
  *end = rest;
  return error == std::errc() && *number > 0;
}

bool ReadArguments(int argc, char* argv[], Request* request) {
  for (int i = 1; i < argc; i++) {
    const std::string argument = argv[i];
    const char* end = "";
    if (argument == "--data") {
      request->data = true;
    } else if (argument.starts_with("--")) {
      if (++i == argc) return false;
      int* number = argument == "--frames"  ? &request->frames
                    : argument == "--steps" ? &request->steps
                    : argument == "--size"  ? &request->width
                                            : nullptr;
      if (!number || !ReadNumber(argv[i], number, &end)) return false;
      if (number == &request->width &&
          (*end != 'x' || !ReadNumber(end + 1, &request->height, &end)))
        return false;
      if (*end != '\0') return false;
    } else if (request->world.empty()) {
      request->world = argument;
    } else {
      return false;
    }
  }
  return !request->world.empty();
}

double Milliseconds(const std::function<void()>& action) {
  const auto start = std::chrono::steady_clock::now();
  action();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

struct Times {
  const char* name;
  std::vector<double> values;

  double At(double fraction) {
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(fraction * static_cast<double>(values.size() - 1))];
  }
  void Print() {
    const double median = At(0.5), late = At(0.95);
    std::printf("%-6s median %8.3f ms  p95 %8.3f ms  %8.1f per second\n", name, median, late,
                1000 / median);
  }
};

int Run(const Request& request) {
  Stg::World world;
  if (!world.Load(request.world)) return 1;
  std::string error;
  const auto context = Stg::offscreen::Context::Make(request.width, request.height, &error);
  Stg::draw::Renderer renderer;
  if (!context || !renderer.Prepare(&error)) {
    std::fprintf(stderr, "draw: %s\n", error.c_str());
    return 1;
  }
  Stg::view::ViewState view;
  view.Load(world.GetWorldFile());
  view.options.Set(Show::kData, request.data);
  Stg::draw::RenderScene scene;
  for (int i = 0; i < request.steps; i++) world.Update();

  Times copy{"copy", {}}, draw{"draw", {}}, both{"both", {}}, steps{"step", {}};
  constexpr int kWarmUp = 5;
  for (int i = 0; i < request.frames + kWarmUp; i++) {
    const double step = Milliseconds([&] { world.Update(); });
    const double copied =
        Milliseconds([&] { scene.Update(world, view, request.width, request.height); });
    const double drawn = Milliseconds([&] {
      context->Bind();
      renderer.Draw(scene, Stg::draw::Hud{world.ClockString(), {}});
      glFinish();
    });
    if (i < kWarmUp) continue;
    copy.values.push_back(copied);
    draw.values.push_back(drawn);
    both.values.push_back(copied + drawn);
    steps.values.push_back(step);
  }
  std::printf("%s, %d x %d pixels on %s\n", request.world.c_str(), request.width, request.height,
              context->device().c_str());
  std::printf("%zu models, %zu bodies and %zu fans of rays in view, %d frames\n",
              scene.model_count(), scene.bodies_in_view(), scene.fans_in_view(), request.frames);
  std::printf("%u draw calls and %zu vertices per frame\n", renderer.draw_calls(),
              renderer.vertices());
  for (Times* times : {&copy, &draw, &both, &steps}) times->Print();
  return 0;
}

}  // namespace

int main(int argc, char* argv[]) {
  Request request;
  if (!ReadArguments(argc, argv, &request)) return Usage();
  Stg::Init(&argc, &argv);
  return Run(request);
}
