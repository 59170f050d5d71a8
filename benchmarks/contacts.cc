// SPDX-License-Identifier: GPL-2.0-or-later
//
// Contacts of outlines: 10 000 free robots, a heap of 1000 robots that touch, and the heap with 100
// boxes. The time of an item is that of a mover-step.

#include "motion/contacts.hh"

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "geometry/trigonometry.hh"

namespace {

using namespace Stg::motion;

class Crowd {
 public:
  /// Robots (discs, or discs, squares and polygons of 16 corners) and boxes in rows, with walls
  /// around.
  Crowd(int count, double spacing, int boxes, bool mixed) {
    const int side = static_cast<int>(std::ceil(std::sqrt(count)));
    const double half = 0.5 * side * spacing + 0.1;
    std::vector<Vector> round, square{{-0.14, -0.14}, {0.14, -0.14}, {0.14, 0.14}, {-0.14, 0.14}};
    for (int i = 0; i < 16; i++) {
      const Stg::SineCosine at = Stg::SinCos(i * M_PI / 8.0);
      round.push_back({0.2 * at.cosine, 0.2 * at.sine});
    }
    const Polygon polygons[] = {{round, {}}, {square, {}}};
    const Disc disc{{}, 0.2, {}};
    const uint32_t of_disc = shapes_.Add({}, {&disc, 1});
    const uint32_t of_round = shapes_.Add({&polygons[0], 1}, {});
    const uint32_t of_square = shapes_.Add({&polygons[1], 1}, {});
    for (int i = 0; i < count; i++) {
      Row row;
      row.x = (i % side + 0.5) * spacing - half + 0.1;
      row.y = (i / side + 0.5) * spacing - half + 0.1;
      row.friction = 0.2;
      row.pushable = i % 11 == 0 && i / 11 < boxes;
      row.grip = row.pushable ? 5.0 : 10.0;
      const int kind = mixed ? static_cast<int>(4.0 * Random()) : 0;
      row.shape = row.pushable || kind == 1 ? of_square : kind == 0 ? of_disc : of_round;
      row.heading = row.shape == of_square ? 0.0 : 6.28 * Random() - 3.14;
      columns_.Add(row, shapes_.shapes[row.shape]);
      ahead_.push_back(0.0);
      turn_.push_back(0.0);
    }
    const Vector corners[] = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
    walls_.Add(corners, true);
    walls_.Index();
    contacts_.tell = false;
  }

  void CommandAtRandom(double share, double speed) {
    for (size_t i = 0; i < columns_.size(); i++) {
      if (columns_.pushable[i] || Random() > share) continue;
      ahead_[i] = speed * (Random() - 0.2);
      turn_[i] = 3.0 * Random() - 1.5;
    }
  }
  void SetTargets() {
    for (size_t i = 0; i < columns_.size(); i++) {
      const Stg::SineCosine heading = Stg::SinCos(columns_.heading[i] + 0.05 * turn_[i]);
      columns_.target_x[i] = columns_.x[i] + 0.1 * ahead_[i] * heading.cosine;
      columns_.target_y[i] = columns_.y[i] + 0.1 * ahead_[i] * heading.sine;
      columns_.turn[i] = 0.1 * turn_[i];
      columns_.target_heading[i] = columns_.heading[i] + columns_.turn[i];
    }
  }
  void Step() { contacts_.Step(shapes_, walls_, &columns_); }

  /// Reports an error unless about the expected share of the bodies are in islands.
  void Check(benchmark::State& state, double least, double most) const {
    const double share = static_cast<double>(contacts_.nearby().members.size()) /
                         static_cast<double>(columns_.size());
    double made = 0.0;
    for (const double m : columns_.made) made += m;
    state.counters["in islands"] = share;
    state.counters["made"] = made / static_cast<double>(columns_.size());
    if (share < least || share > most) state.SkipWithError("not the work that is meant");
  }
  size_t size() const { return columns_.size(); }

 private:
  double Random() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }

  Shapes shapes_;
  Walls walls_;
  Columns columns_;
  Contacts contacts_;
  std::vector<double> ahead_, turn_;
  uint64_t state_ = 7;
};

void Run(benchmark::State& state, Crowd* crowd, int warm_up, double share, double least,
         double most) {
  constexpr int kSteps = 10;
  for (int i = 0; i < warm_up; i++) {
    crowd->CommandAtRandom(share, 0.8);
    crowd->SetTargets();
    crowd->Step();
  }
  const Crowd begin = *crowd;
  int step = 0;
  for (auto _ : state) {
    state.PauseTiming();
    if (step++ % kSteps == 0) *crowd = begin;  // it would spread
    crowd->CommandAtRandom(share, 0.8);
    crowd->SetTargets();
    state.ResumeTiming();
    crowd->Step();
  }
  crowd->Check(state, least, most);
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(crowd->size()));
}

void BM_Free(benchmark::State& state) {
  Crowd crowd(10000, 1.5, 0, false);
  Run(state, &crowd, 1, 1.0, 0.0, 0.1);
}
BENCHMARK(BM_Free)->Unit(benchmark::kMillisecond);

void BM_Heap(benchmark::State& state) {
  Crowd crowd(1000, 0.405, static_cast<int>(state.range(1)), state.range(0) != 0);
  Run(state, &crowd, 30, 0.2, 0.95, 1.0);
}
BENCHMARK(BM_Heap)
    ->ArgNames({"mixed", "boxes"})
    ->Args({0, 0})
    ->Args({1, 0})
    ->Args({1, 90})
    ->Unit(benchmark::kMillisecond);

}  // namespace
