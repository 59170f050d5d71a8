// SPDX-License-Identifier: GPL-2.0-or-later
//
// How the time of rare things grows with their number: loading, deleting, crowds in one place. Each
// is run with N and 2N; a time that grows by four where the work grows by two is a defect.
// --benchmark_filter=NAME picks one.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"

namespace {

std::string Repeat(int64_t count, const std::function<std::string(int64_t)>& text_of) {
  std::string text;
  for (int64_t i = 0; i < count; i++) text += text_of(i);
  return text;
}

/// A model's properties in a rectangle of them, so many metres apart.
std::string PoseOf(int64_t i, double distance) {
  const auto side = int64_t{1000};
  const int64_t row = i / side;
  return "pose [" + std::to_string(static_cast<double>(i % side) * distance) + " " +
         std::to_string(static_cast<double>(row) * distance) + " 0 0]";
}

std::unique_ptr<Stg::World> Load(const std::string& text) {
  if (!Stg::InitDone()) Stg::Init(nullptr, nullptr);
  auto world = std::make_unique<Stg::World>();
  std::istringstream content(text);
  if (!world->Load(content, "scaling.world")) std::abort();
  return world;
}

using TextOf = std::string (*)(int64_t count);

std::string Scattered(int64_t count) {
  return Repeat(count, [](int64_t i) { return "model( " + PoseOf(i, 30) + " )\n"; });
}
std::string Dense(int64_t count) {
  return Repeat(count, [](int64_t i) { return "model( " + PoseOf(i, 1) + " )\n"; });
}
std::string OneName(int64_t count) {
  return Repeat(count, [](int64_t) { return "model( name \"robot\" size [0.01 0.01 0.01] )\n"; });
}
std::string Siblings(int64_t count) {
  return "model( " + Repeat(count, [](int64_t i) { return "model( " + PoseOf(i, 1) + " )\n"; }) +
         ")";
}
std::string Finders(int64_t count) {
  return Repeat(count, [](int64_t i) {
    return "model( fiducial_return 1 " + PoseOf(i, 1) + " fiducial( alwayson 1 range_max 3 ) )\n";
  });
}
std::string Radios(int64_t count) {
  return Repeat(count, [](int64_t i) { return "wifi( " + PoseOf(i, 1) + " )\n"; });
}
std::string Rangers(int64_t count) {
  return Repeat(count, [](int64_t i) {
    return "position( alwayson 1 " + PoseOf(i, 1) + " ranger( alwayson 1 sensor( ) ) )\n";
  });
}
std::string Hidden(int64_t count) {
  return Repeat(count,
                [](int64_t i) { return "model( ranger_return -1 " + PoseOf(i, 1) + " )\n"; });
}
std::string Packs(int64_t count) {
  return Repeat(count,
                [](int64_t i) { return "model( alwayson 1 joules 1000 " + PoseOf(i, 1) + " )\n"; });
}
/// In one place, all of which charge each other.
std::string Chargers(int64_t count) {
  return Repeat(count, [](int64_t) {
    return "model( alwayson 1 joules 1000 joules_capacity 2000 give_watts 1 take_watts 1 )\n";
  });
}
std::string Crowd(int64_t count) {
  return Repeat(count, [](int64_t) { return "model( obstacle_return 0 )\n"; });
}

void LoadWorld(benchmark::State& state, TextOf text_of) {
  const std::string text = text_of(state.range(0));
  for (auto _ : state) {
    auto world = Load(text);
    state.PauseTiming();
    world.reset();
    state.ResumeTiming();
  }
}

void UnloadWorld(benchmark::State& state, TextOf text_of) {
  const std::string text = text_of(state.range(0));
  for (auto _ : state) {
    state.PauseTiming();
    auto world = Load(text);
    world->Update();
    world->Update();
    state.ResumeTiming();
    world->UnLoad();
    state.PauseTiming();
    world.reset();
    state.ResumeTiming();
  }
}

void ThreeSteps(benchmark::State& state, TextOf text_of) {
  const std::string text = text_of(state.range(0));
  for (auto _ : state) {
    state.PauseTiming();
    auto world = Load(text);
    state.ResumeTiming();
    for (int i = 0; i < 3; i++) world->Update();
    state.PauseTiming();
    world.reset();
    state.ResumeTiming();
  }
}

/// Which of the children go first.
enum Order { kOldestFirst, kYoungestFirst, kScattered };

void DeleteAll(benchmark::State& state, TextOf text_of, Order order) {
  const std::string text = text_of(state.range(0));
  for (auto _ : state) {
    state.PauseTiming();
    auto world = Load(text);
    world->Update();
    world->Update();
    std::vector<Stg::Model*> victims(world->GetChildren().begin() + 1, world->GetChildren().end());
    if (victims.size() == 1) victims = victims[0]->GetChildren();
    if (order == kYoungestFirst) std::reverse(victims.begin(), victims.end());
    for (size_t i = 0; order == kScattered && i < victims.size(); i++)
      std::swap(victims[i], victims[i * 7919 % victims.size()]);
    state.ResumeTiming();
    for (const Stg::Model* model : victims) delete model;
    state.PauseTiming();
    world.reset();
    state.ResumeTiming();
  }
}

int DeleteIt(Stg::Model* model, void*) {
  delete model;
  return 0;
}

/// Each in a callback of its own, in one step.
void DeleteInCallbacks(benchmark::State& state) {
  const std::string text = Rangers(state.range(0));
  for (auto _ : state) {
    state.PauseTiming();
    auto world = Load(text);
    for (Stg::Model* model : world->GetChildren())
      model->AddCallback(Stg::Model::CB_UPDATE, DeleteIt, nullptr);
    state.ResumeTiming();
    for (int i = 0; i < 3; i++) world->Update();
    state.PauseTiming();
    world.reset();
    state.ResumeTiming();
  }
}

int Nothing(Stg::Model*, void*) { return 0; }

void QueueEvents(benchmark::State& state) {
  auto world = Load("model( )");
  for (auto _ : state) {
    for (int64_t i = 0; i < state.range(0); i++)
      world->Enqueue(0, static_cast<Stg::usec_t>(i * 7919 % 100000), world->GetChildren()[1],
                     Nothing, nullptr);
    world->Update();
    world->Update();
  }
}

void AddCallbacks(benchmark::State& state) {
  auto world = Load("model( )");
  Stg::Model* model = world->GetChildren()[1];
  std::vector<char> users(static_cast<size_t>(state.range(0)));
  for (auto _ : state) {
    for (char& user : users) model->AddCallback(Stg::Model::CB_UPDATE, Nothing, &user);
    model->CallCallbacks(Stg::Model::CB_UPDATE);
    model->RemoveCallback(Stg::Model::CB_UPDATE, Nothing);
  }
}

#define SCALES(function, count) \
  BENCHMARK(function)->Arg(count)->Arg(2 * (count))->Iterations(1)->Unit(benchmark::kMillisecond)
#define SCALES_WITH(function, name, count, ...)  \
  BENCHMARK_CAPTURE(function, name, __VA_ARGS__) \
      ->Arg(count)                               \
      ->Arg(2 * (count))                         \
      ->Iterations(1)                            \
      ->Unit(benchmark::kMillisecond)

SCALES_WITH(LoadWorld, Scattered, 30000, Scattered);
SCALES_WITH(LoadWorld, Dense, 30000, Dense);
SCALES_WITH(LoadWorld, OneName, 10000, OneName);
SCALES_WITH(LoadWorld, Siblings, 10000, Siblings);
SCALES_WITH(LoadWorld, Crowd, 10000, Crowd);
SCALES_WITH(UnloadWorld, Scattered, 30000, Scattered);
SCALES_WITH(UnloadWorld, Rangers, 10000, Rangers);
SCALES_WITH(UnloadWorld, Packs, 10000, Packs);
SCALES_WITH(UnloadWorld, Radios, 10000, Radios);
SCALES_WITH(UnloadWorld, Finders, 10000, Finders);
SCALES_WITH(UnloadWorld, Crowd, 10000, Crowd);
SCALES_WITH(ThreeSteps, Chargers, 400, Chargers);
SCALES_WITH(ThreeSteps, Packs, 10000, Packs);
SCALES_WITH(ThreeSteps, Finders, 10000, Finders);
SCALES_WITH(DeleteAll, OldestFirst, 10000, Dense, kOldestFirst);
SCALES_WITH(DeleteAll, YoungestFirst, 10000, Dense, kYoungestFirst);
SCALES_WITH(DeleteAll, InAnyOrder, 10000, Dense, kScattered);
SCALES_WITH(DeleteAll, OneName, 10000, OneName, kOldestFirst);
SCALES_WITH(DeleteAll, Siblings, 10000, Siblings, kOldestFirst);
SCALES_WITH(DeleteAll, Rangers, 10000, Rangers, kScattered);
SCALES_WITH(DeleteAll, Finders, 10000, Finders, kScattered);
SCALES_WITH(DeleteAll, Radios, 10000, Radios, kScattered);
SCALES_WITH(DeleteAll, Packs, 10000, Packs, kScattered);
SCALES_WITH(DeleteAll, Hidden, 10000, Hidden, kScattered);
SCALES_WITH(DeleteAll, Crowd, 10000, Crowd, kScattered);
SCALES(DeleteInCallbacks, 10000);
SCALES(QueueEvents, 10000);
SCALES(AddCallbacks, 10000);

}  // namespace
