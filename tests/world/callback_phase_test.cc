// SPDX-License-Identifier: GPL-2.0-or-later
//
// Callbacks on several threads have the same effect as callbacks in sequence, for any list of
// models.

#include "world/phases/callback_phase.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "support/random_source.hh"
#include "world/engine.hh"

namespace {

using Stg::test::RandomSource;

constexpr int kTrees = 400, kOfTree = 3;

/// The data of a model's callback.
struct Note {
  std::atomic<int>* calls;  // counter of the calls of all models
  std::vector<int>* tree;   // numbers of this tree's models in the order of calls
  std::vector<int>* seen;   // for serial callbacks: calls before each one; else null
  int number;
  static int Take(Stg::Model*, void* user) {
    const auto& note = *static_cast<Note*>(user);
    const int before = (*note.calls)++;
    note.tree->push_back(note.number);
    if (note.seen) note.seen->push_back(before);
    return 0;
  }
};

/// Trees of a robot and two rangers, whose callbacks record their calls.
class Robots {
 public:
  /// If is_serial(i), the callback of model i must be called alone.
  template <typename F>
  explicit Robots(F is_serial) : calls_(0), trees_(kTrees), notes_(kTrees * kOfTree) {
    std::string text;
    for (int i = 0; i < kTrees; i++) text += "position( ranger( ) ranger( ) )\n";
    world_ = Stg::LoadText(text);
    for (Stg::Model* robot : world_->GetChildren()) {
      if (robot->GetChildren().empty()) continue;  // the ground
      Add(robot, is_serial);
      for (Stg::Model* ranger : robot->GetChildren()) Add(ranger, is_serial);
    }
  }

  const std::vector<Stg::Model*>& models() const { return models_; }

  struct Outcome {
    std::vector<std::vector<int>> trees;
    std::vector<int> seen;
    bool operator==(const Outcome&) const = default;
  };
  /// Calls the callbacks of a list as the engine does, and counts those that were called in
  /// parallel.
  Outcome Call(const std::vector<Stg::Model*>& list, unsigned threads, size_t* together) {
    Stg::threads::WorkerPool workers(threads);
    const Stg::ScopedValue stepping(&world_->engine().stepping, true);
    phase_.SetMinLength(1);
    phase_.EndStep();
    for (auto& tree : trees_) tree.clear();
    seen_.clear();
    calls_ = 0;
    for (size_t i = 0; i < list.size();) {
      const size_t count = phase_.CallParallel(&list[i], list.size() - i, &workers);
      *together += count;
      i += count;
      if (count > 0) continue;
      if (list[i]) list[i]->CallCallbacks(Stg::Model::CB_UPDATE);
      i++;
    }
    return {trees_, seen_};
  }

 private:
  template <typename F>
  void Add(Stg::Model* model, F is_serial) {
    const size_t i = models_.size();
    const bool serial = is_serial(i);
    notes_[i] = {&calls_, &trees_[i / kOfTree], serial ? &seen_ : nullptr, static_cast<int>(i)};
    if (serial)
      model->AddCallback(Stg::Model::CB_UPDATE, Note::Take, &notes_[i]);
    else
      model->AddParallelCallback(Stg::Model::CB_UPDATE, Note::Take, &notes_[i]);
    models_.push_back(model);
  }

  std::atomic<int> calls_;
  std::vector<std::vector<int>> trees_;
  std::vector<int> seen_;
  std::vector<Note> notes_;
  std::unique_ptr<Stg::World> world_;
  std::vector<Stg::Model*> models_;
  Stg::CallbackPhase phase_;  // reused, because trees remember its runs
};

void ExpectSameAsInTurn(Robots* robots, const std::vector<Stg::Model*>& list, size_t* together) {
  size_t none = 0;
  const Robots::Outcome in_turn = robots->Call(list, 1, &none);
  EXPECT_EQ(none, 0u);
  for (const unsigned threads : {2u, 4u})
    EXPECT_TRUE(robots->Call(list, threads, together) == in_turn) << threads << " threads";
}

TEST(CallbackPhase, AllAtOnce) {
  Robots robots([](size_t) { return false; });
  size_t together = 0;
  ExpectSameAsInTurn(&robots, robots.models(), &together);
  EXPECT_EQ(together, 2 * robots.models().size());
}

TEST(CallbackPhase, TreesThatComeAgain) {
  Robots robots([](size_t) { return false; });
  std::vector<Stg::Model*> list = robots.models();
  // Repeat the first model at the end and elsewhere, then a neighbour, then all models in both
  // orders.
  list.push_back(list[0]);
  list.insert(list.begin() + 700, list[0]);
  list.insert(list.begin() + 500, list[499]);
  list.insert(list.end(), robots.models().begin(), robots.models().end());
  list.insert(list.end(), robots.models().rbegin(), robots.models().rend());
  size_t together = 0;
  ExpectSameAsInTurn(&robots, list, &together);
  EXPECT_EQ(together, 2 * list.size());
}

TEST(CallbackPhase, ModelsThatAreGone) {
  Robots robots([](size_t) { return false; });
  for (const size_t gone : {0, 1, 600, 1199}) {
    std::vector<Stg::Model*> list = robots.models();
    list[gone] = nullptr;
    size_t together = 0;
    ExpectSameAsInTurn(&robots, list, &together);
    EXPECT_EQ(together, 2 * list.size()) << gone;
  }
  size_t together = 0;
  ExpectSameAsInTurn(&robots, std::vector<Stg::Model*>(100, nullptr), &together);
}

TEST(CallbackPhase, SerialOnesInTheMiddle) {
  for (const size_t serial : {0, 1, 2, 600, 1199}) {
    Robots robots([serial](size_t i) { return i == serial; });
    size_t together = 0;
    ExpectSameAsInTurn(&robots, robots.models(), &together);
    EXPECT_EQ(together, 2 * (robots.models().size() - 1)) << serial;
  }
}

TEST(CallbackPhase, AnyList) {
  RandomSource random(1);
  size_t together = 0;
  for (int round = 0; round < 20; round++) {
    const uint64_t rarity = uint64_t{1} << random.Int(2, 12);
    Robots robots([&](size_t) { return random.OneIn(rarity); });
    for (int time = 0; time < 3; time++) {
      std::vector<Stg::Model*> list = robots.models();
      for (Stg::Model*& model : list) {
        if (random.OneIn(rarity)) model = nullptr;
        if (random.OneIn(rarity)) model = random.Pick(robots.models());
      }
      if (random.OneIn(2)) list.resize(static_cast<size_t>(random.Int(1, 1200)));
      ExpectSameAsInTurn(&robots, list, &together);
      if (testing::Test::HasFailure()) return;
    }
  }
  EXPECT_GT(together, 10000u);
}

}  // namespace
