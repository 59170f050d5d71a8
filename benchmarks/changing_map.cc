// SPDX-License-Identifier: GPL-2.0-or-later
//
// Time to replace the map of a scene, 200 x 200 cells of 0.05 m, and of making the scene anew.
//
// Each map is the base, rooms of 2 m, with other random cells inverted: 1, 10 or 100 percent of
// them. So a change from one to the next changes up to twice as many. With 0 percent, it is a block
// of 20 x 20 cells elsewhere, 1 percent of all. Reports an error if the walls
// or the obstacles are not those of a new scene.

#include "rows/changing_map.hh"

#include <benchmark/benchmark.h>

#include <bit>
#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "rows/row_bridge.hh"
#include "stage.hh"

namespace {

using Stg::rows::ChangingMap;
using Stg::rows::Scene;

constexpr int kSide = 200;

using Cells = std::vector<uint8_t>;  // rows from below

Cells Rooms() {
  Cells cells(kSide * kSide);
  for (int y = 0; y < kSide; y++)
    for (int x = 0; x < kSide; x++) {
      const bool wall = x % 40 == 0 || y % 40 == 0 || x == kSide - 1 || y == kSide - 1;
      const bool door = (x % 40 > 10 && x % 40 < 30) || (y % 40 > 10 && y % 40 < 30);
      const bool thing = x % 25 == 12 && y % 25 > 20;
      cells[static_cast<size_t>(y * kSide + x)] = (wall && !door) || thing;
    }
  return cells;
}

/// Maps with this share of cells inverted, in percent; 0: those of a block.
std::vector<Cells> Changed(int64_t percent) {
  std::mt19937_64 random(3);
  std::vector<Cells> all(16, Rooms());
  for (size_t i = 0; i < all.size() && percent == 0; i++)
    for (size_t k = 0; k < 400; k++) {
      uint8_t& cell = all[i][(7 + 11 * i + k / 20) * kSide + 30 + 5 * i + k % 20];
      cell = !cell;
    }
  for (size_t i = 0; i < all.size(); i++)
    for (uint8_t& cell : all[i]) {
      const bool chosen =
          percent == 100 ? i % 2 == 1 : random() % 100 < static_cast<uint64_t>(percent);
      if (chosen) cell = !cell;
    }
  return all;
}

std::unique_ptr<Stg::World> Load(const Cells& cells, const std::string& contacts) {
  std::string picture = "P4\n" + std::to_string(kSide) + " " + std::to_string(kSide) + "\n";
  for (int y = kSide - 1; y >= 0; y--)
    for (int x = 0; x < kSide; x += 8) {
      unsigned bits = 0;
      for (int i = 0; i < 8; i++)
        bits |= (cells[static_cast<size_t>(y * kSide + x + i)] ? 0x80u : 0u) >> i;
      picture += static_cast<char>(bits);
    }
  std::string text = "contacts \"" + contacts +
                     "\"\nmodel( name \"map\" pose [-5 -5 0 0] origin [5 5 0 0] size [10 10 1] "
                     "bitmap \"map.pbm\" bitmap_frame \"picture\" gui_move 0 )\n";
  for (int i = 0; i < 6; i++)
    text += "position( pose [" + std::to_string(i - 2.5) +
            " 0.5 0 0] size [0.3 0.3 0.4] round 1 ranger( sensor( range [0 5] samples 16 ) ) )\n";
  Stg::RunOptions options;
  options.threads = 1;
  options.listed = false;
  options.pictures = std::make_shared<const std::map<std::string, std::string>>(
      std::map<std::string, std::string>{{"map.pbm", picture}});
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content(text);
  if (!world->Load(content, "map.world")) return nullptr;
  for (Stg::Model* model : world->GetAllModels())
    if (model->GetModelType() != "model") model->Subscribe();
  return world;
}

/// Numbers of walls and of cells of obstacles.
std::pair<size_t, size_t> SizeOf(const Scene& scene) {
  size_t cells = 0;
  for (const uint64_t word : scene.blocked[0].content().bits)
    cells += static_cast<size_t>(std::popcount(word));
  return {scene.walls.edges().size(), cells};
}

void Prepare() {
  static const bool prepared = [] {
    Stg::Init(nullptr, nullptr);
    return true;
  }();
  (void)prepared;
}

const char* ContactsOf(int64_t kind) { return kind ? "outlines" : "cells"; }

void Set(benchmark::State& state) {
  Prepare();
  const std::vector<Cells> maps = Changed(state.range(0));
  const std::string contacts = ContactsOf(state.range(1));
  std::string reason;
  const auto changing = ChangingMap::Make(Load(Rooms(), contacts), "map", &reason);
  if (!changing) return state.SkipWithError(reason.c_str());
  size_t next = 0;
  for (const Cells& cells : maps) changing->Set(cells);
  for (auto _ : state)
    if (!changing->Set(maps[next++ % maps.size()])) return state.SkipWithError("nothing changed");
  changing->Set(maps[3]);
  const auto scene = Stg::RowBridge::MakeScene(Load(maps[3], contacts), &reason);
  if (SizeOf(*changing->scene()) != SizeOf(*scene)) state.SkipWithError("another map");
  state.counters["walls"] = static_cast<double>(SizeOf(*scene).first);
}

void NewScene(benchmark::State& state) {
  Prepare();
  const std::vector<Cells> maps = Changed(state.range(0));
  std::string reason;
  size_t next = 0;
  for (auto _ : state) {
    const auto scene = Stg::RowBridge::MakeScene(
        Load(maps[next++ % maps.size()], ContactsOf(state.range(1))), &reason);
    if (!scene) return state.SkipWithError(reason.c_str());
  }
}

BENCHMARK(Set)
    ->ArgNames({"percent", "outlines"})
    ->ArgsProduct({{0, 1, 10, 100}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(NewScene)
    ->ArgNames({"percent", "outlines"})
    ->ArgsProduct({{0, 1, 10, 100}, {1}})
    ->Unit(benchmark::kMicrosecond);

}  // namespace
