// SPDX-License-Identifier: GPL-2.0-or-later
//
// Scheduling: update intervals, subscriptions, the order of a step, quitting, and the clock.

#include "support/model_testing.hh"

namespace Stg {
namespace {

/// Records "name@milliseconds" at each update of a model.
int NoteUpdate(Model* mod, void* journal) {
  static_cast<Journal*>(journal)->entries.push_back(
      mod->TokenStr() + "@" + std::to_string(mod->GetWorld()->SimTimeNow() / 1000));
  return 0;
}

Model* Noted(World& world, const std::string& name, Journal* journal) {
  Model* model = Find(world, name);
  model->AddCallback(Model::CB_UPDATE, NoteUpdate, journal);
  return model;
}

size_t StepsUntilDone(World& world) {
  size_t steps = 0;
  while (!world.Update() && steps < 1000) steps++;
  return steps;
}

class Restless : public Model {
 public:
  using Model::Model;
  void Update() override {
    updates++;
    Model::Update();
  }
  int updates = 0;
};

// ---- intervals ----------------------------------------------------------------------------------

// Stage adds the interval to the time of the last update and rounds up: 150 ms become 200 ms.
TEST(Intervals, UpdateInTheFirstStepAtOrAfterEachMultiple) {
  struct {
    const char *interval, *updates;
  } const cases[] = {{"100", "a@100 a@200 a@300 a@400 a@500 a@600"},
                     {"50", "a@100 a@200 a@300 a@400 a@500 a@600"},
                     {"1", "a@100 a@200 a@300 a@400 a@500 a@600"},
                     {"150", "a@200 a@300 a@500 a@600"},
                     {"200", "a@200 a@400 a@600"},
                     {"250", "a@300 a@500"},
                     // With 0, Stage hangs; with -5, it never updates.
                     {"0", "a@100 a@200 a@300 a@400 a@500 a@600"},
                     {"-5", "a@100 a@200 a@300 a@400 a@500 a@600"},
                     {"33.7", "a@100 a@200 a@300 a@400 a@500 a@600"},
                     {"2147483647", ""}};
  for (const auto& c : cases) {
    const auto world =
        LoadText("model( name \"a\" alwayson 1 update_interval " + std::string(c.interval) + " )");
    Journal journal;
    Noted(*world, "a", &journal);
    Step(*world, 6);
    EXPECT_EQ(journal.Text(), c.updates) << c.interval;
  }
}

TEST(Intervals, NonMultiplesOfAStepAreNotRounded) {
  const auto world = LoadText("interval_sim 40 model( name \"a\" alwayson 1 update_interval 100 )");
  Journal journal;
  Noted(*world, "a", &journal);
  Step(*world, 13);
  EXPECT_EQ(journal.Text(), "a@120 a@200 a@320 a@400 a@520");
  EXPECT_EQ(Find(*world, "a")->GetUpdateInterval(), 100000u);
}

TEST(Intervals, GiveTheRequestedMeanRate) {
  const usec_t seconds = 6;
  for (const usec_t step : {5, 10, 20, 33, 100})
    for (const usec_t interval : {1, 7, 25, 30, 40, 100, 250, 333}) {
      const auto world = LoadText("interval_sim " + std::to_string(step) +
                                  " model( name \"a\" alwayson 1 update_interval " +
                                  std::to_string(interval) + " )");
      Journal journal;
      Noted(*world, "a", &journal);
      const usec_t steps = seconds * 1000 / step;
      Step(*world, static_cast<int>(steps));
      // No model updates twice in a step.
      EXPECT_EQ(journal.entries.size(), steps * step / std::max(step, interval))
          << "steps of " << step << " ms, an interval of " << interval << " ms";
    }
}

TEST(Intervals, DoNotDependOnTheTimeOfSubscription) {
  for (const usec_t interval : {20, 30, 100, 200})
    for (int late = 0; late < 12; late++) {
      const auto world =
          LoadText("interval_sim 10 model( name \"a\" alwayson 1 update_interval " +
                   std::to_string(interval) + " ) model( name \"b\" update_interval " +
                   std::to_string(interval) + " )");
      Step(*world, late);
      Find(*world, "b")->Subscribe();
      for (int i = 0; i < 60; i++) {
        Step(*world, 1);
        const usec_t now = world->SimTimeNow();
        EXPECT_EQ(Find(*world, "a")->GetLastUpdate() == now,
                  Find(*world, "b")->GetLastUpdate() == now)
            << "an interval of " << interval << " ms, subscribed after " << late << " steps, at "
            << now;
      }
    }
}

TEST(Intervals, TheFirstUpdateIsAtTheNextMultipleAfterTheSubscription) {
  const auto world = LoadText("model( name \"a\" update_interval 200 )");
  Journal journal;
  Model* a = Noted(*world, "a", &journal);
  EXPECT_EQ(a->GetLastUpdate(), 0u);
  Step(*world, 3);
  a->Subscribe();
  Step(*world, 4);
  EXPECT_EQ(journal.Text(), "a@400 a@600");
  EXPECT_EQ(a->GetLastUpdate(), 600000u);
}

// ---- subscriptions ------------------------------------------------------------------------------

TEST(Subscriptions, AreCounted) {
  const auto world = LoadText("model( name \"a\" )");
  Journal journal;
  Model* a = Noted(*world, "a", &journal);
  Step(*world, 2);
  EXPECT_FALSE(a->HasSubscribers());
  a->Subscribe();
  a->Subscribe();
  EXPECT_EQ(a->GetSubscriptionCount(), 2u);
  Step(*world);
  a->Unsubscribe();
  EXPECT_TRUE(a->HasSubscribers());
  Step(*world);
  a->Unsubscribe();
  Step(*world, 3);
  EXPECT_EQ(journal.Text(), "a@300 a@400");  // Stage makes one more update
}

TEST(Subscriptions, CannotFallBelowZero) {
  const auto world = LoadText("model( name \"a\" )");
  Model* a = Find(*world, "a");
  OutputOf([&] {
    a->Unsubscribe();
    a->Unsubscribe();
  });
  EXPECT_EQ(a->GetSubscriptionCount(), 0u);
  a->Subscribe();
  EXPECT_EQ(a->GetSubscriptionCount(), 1u);
}

// In Stage 4.3, each subscription before the pending event starts an additional series of updates.
TEST(Subscriptions, AModelIsUpdatedOncePerIntervalHoweverOftenItIsSubscribedTo) {
  const auto world = LoadText("model( name \"a\" update_interval 200 )");
  Journal journal;
  Model* a = Noted(*world, "a", &journal);
  a->Subscribe();
  Step(*world);
  for (int i = 0; i < 5; i++) {
    a->Unsubscribe();
    a->Subscribe();
  }
  Step(*world, 7);
  EXPECT_EQ(journal.Text(), "a@200 a@400 a@600 a@800");
}

// An explicit update replaces the next scheduled one and does not start a second series.
TEST(Subscriptions, ExplicitUpdateRestartsTheInterval) {
  const auto world = EmptyWorld();
  auto* model = new Restless(world.get());
  model->Subscribe();
  model->Update();
  EXPECT_EQ(model->updates, 1);
  for (int step = 1; step <= 5; step++) {
    Step(*world);
    EXPECT_EQ(model->updates, 1 + step);
  }
  for (int step = 1; step <= 5; step++) {
    model->Update();
    Step(*world);
    EXPECT_EQ(model->updates, 6 + 2 * step);
  }
  Step(*world, 5);
  EXPECT_EQ(model->updates, 21);
}

TEST(Subscriptions, CanBeChangedInCallbacks) {
  const auto world = LoadText("model( name \"a\" alwayson 1 ) model( name \"b\" )");
  Journal journal;
  Model* a = Find(*world, "a");
  Noted(*world, "b", &journal);
  a->AddCallback(
      Model::CB_UPDATE,
      [](Model* mod, void*) {
        Model* b = mod->GetWorld()->GetModel("b");
        if (b->HasSubscribers())
          b->Unsubscribe();
        else
          b->Subscribe();
        return 0;
      },
      nullptr);
  Step(*world, 6);  // on after 100, 300, 500 ms; off after 200, 400, 600 ms
  EXPECT_EQ(journal.Text(), "b@200 b@400 b@600");
  a->AddCallback(
      Model::CB_UPDATE, [](Model* mod, void*) { return mod->Unsubscribe(), 0; }, nullptr);
  Step(*world, 3);
  EXPECT_FALSE(a->HasSubscribers());
}

// ---- the order of a step ------------------------------------------------------------------------

TEST(Order, CallbacksFollowTheOrderOfSubscription) {
  const auto world = LoadText("model( name \"a\" ) model( name \"b\" ) model( name \"c\" )");
  Journal journal;
  for (const char* name : {"c", "a", "b"}) Noted(*world, name, &journal)->Subscribe();
  Step(*world, 3);
  EXPECT_EQ(journal.Text(), "c@100 a@100 b@100 c@200 a@200 b@200 c@300 a@300 b@300");
}

TEST(Order, SensorsThenMotionThenCallbacks) {
  const auto world = LoadText(
      "position( name \"r\" size [0.4 0.4 0.2] alwayson 1 ranger( name \"l\" alwayson 1"
      " sensor( range [0 9] ) ) ) model( pose [3 0 0 0] size [1 1 1] )");
  struct Seen {
    double pose = 0, range = 0;
    usec_t time = 0;
    uint64_t updates = 0;
  } seen;
  ModelPosition* robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(0.5, 0, 0);
  Find(*world, "r.l")
      ->AddCallback(
          Model::CB_UPDATE,
          [](Model* mod, void* to) {
            Seen& s = *static_cast<Seen*>(to);
            s.range = static_cast<ModelRanger*>(mod)->GetSensors()[0].ranges[0];
            s.pose = mod->GetGlobalPose().x;
            s.time = mod->GetWorld()->SimTimeNow();
            s.updates = mod->GetWorld()->GetUpdateCount();
            return 0;
          },
          &seen);
  for (int i = 0; i < 10; i++) {
    Step(*world);
    EXPECT_NEAR(seen.pose, 0.05 * (i + 1), 1e-9);           // after the move
    EXPECT_NEAR(seen.range, 2.5 - 0.05 * i, 1.01 * kCell);  // measured before the move
    EXPECT_EQ(seen.time, 100000u * static_cast<unsigned>(i + 1));
    EXPECT_EQ(seen.updates, static_cast<uint64_t>(i));  // not complete yet
  }
}

TEST(Order, ModelCallbacksThenThoseOfTheWorld) {
  const auto world = LoadText("model( name \"a\" alwayson 1 )");
  Journal journal;
  world->AddUpdateCallback(
      [](World*, void* to) {
        static_cast<Journal*>(to)->entries.push_back("world");
        return 0;
      },
      &journal);
  Noted(*world, "a", &journal);
  Step(*world, 2);
  EXPECT_EQ(journal.Text(), "a@100 world a@200 world");
}

// If the follower was created first, Stage tests it against the leader's pose of two steps ago.
TEST(Order, AConvoyDrivesInWhicheverOrderItWasMade) {
  for (const bool follower_first : {true, false}) {
    const std::string follower = "position( name \"f\" pose [0 0 0 0] size [0.4 0.4 0.2] )\n",
                      leader = "position( name \"l\" pose [0.5 0 0 0] size [0.4 0.4 0.2] )\n";
    const auto world = LoadText(follower_first ? follower + leader : leader + follower);
    ModelPosition *f = FindRunning<ModelPosition>(*world, "f"),
                  *l = FindRunning<ModelPosition>(*world, "l");
    f->SetSpeed(0.5, 0, 0);
    l->SetSpeed(0.5, 0, 0);
    for (int i = 0; i < 40; i++) {
      Step(*world);
      EXPECT_FALSE(f->Stalled() || l->Stalled()) << i;
    }
    EXPECT_NEAR(f->GetPose().x, 2, 1e-9);
    EXPECT_NEAR(l->GetPose().x, 2.5, 1e-9);
  }
}

/// Two robots that face each other, 0.1 m apart.
std::unique_ptr<World> RobotsThatMeet(const std::string& contacts, bool left_first) {
  const std::string left = "position( name \"l\" pose [-0.25 0 0 0] size [0.4 0.4 0.2] )\n",
                    right = "position( name \"r\" pose [0.25 0 0 180] size [0.4 0.4 0.2] )\n";
  return LoadText("contacts \"" + contacts + "\"\n" + (left_first ? left + right : right + left));
}

TEST(Order, ModelsMoveInTheOrderOfCreationWhereCellsStopThem) {
  // Two robots move to the same place; the one that was created first gets it.
  for (const bool left_first : {true, false}) {
    const auto world = RobotsThatMeet("cells", left_first);
    // Subscribe in the opposite order, which must not matter.
    ModelPosition *second = FindRunning<ModelPosition>(*world, left_first ? "r" : "l"),
                  *first = FindRunning<ModelPosition>(*world, left_first ? "l" : "r");
    first->SetSpeed(0.6, 0, 0);
    second->SetSpeed(0.6, 0, 0);
    Step(*world);
    EXPECT_FALSE(first->Stalled());
    EXPECT_TRUE(second->Stalled());
  }
}

TEST(Order, OfCreationHasNoInfluenceWhereOutlinesStopModels) {
  for (const bool left_first : {true, false}) {
    const auto world = RobotsThatMeet("outlines", left_first);
    ModelPosition *l = FindRunning<ModelPosition>(*world, "l"),
                  *r = FindRunning<ModelPosition>(*world, "r");
    l->SetSpeed(0.6, 0, 0);
    r->SetSpeed(0.6, 0, 0);
    Step(*world, 3);
    EXPECT_TRUE(l->Stalled());
    EXPECT_TRUE(r->Stalled());
    EXPECT_NEAR(l->GetPose().x, -0.2002, 1e-6);  // both stop half of the gap before the middle
    EXPECT_NEAR(r->GetPose().x, 0.2002, 1e-6);
  }
}

// ---- events -------------------------------------------------------------------------------------

TEST(Enqueue, CallsOnceInTheFirstStepAtOrAfterTheTime) {
  const auto world = LoadText("model( name \"a\" )");
  Journal journal;
  Model* a = Find(*world, "a");
  Step(*world);
  for (const usec_t delay : {250000u, 100000u, 0u, 100001u})
    world->Enqueue(0, delay, a, NoteUpdate, &journal);
  Step(*world);
  EXPECT_EQ(journal.Text(), "a@200 a@200");
  Step(*world, 5);
  EXPECT_EQ(journal.Text(), "a@200 a@200 a@300 a@400");
}

TEST(Enqueue, CanEnqueueItselfAgain) {
  const auto world = LoadText("model( name \"a\" )");
  static Journal journal;
  journal.entries.clear();
  static model_callback_t again;
  again = [](Model* mod, void*) {
    NoteUpdate(mod, &journal);
    mod->GetWorld()->Enqueue(0, 0, mod, again, nullptr);  // not in the same step
    return 1;
  };
  world->Enqueue(0, 0, Find(*world, "a"), again, nullptr);
  Step(*world, 3);
  EXPECT_EQ(journal.Text(), "a@100 a@200 a@300");
}

TEST(Enqueue, ForgetsModelsThatAreDeleted) {
  const auto world = LoadText("model( name \"a\" ) model( name \"b\" alwayson 1 )");
  Journal journal;
  world->Enqueue(0, 100000, Find(*world, "a"), NoteUpdate, &journal);
  Noted(*world, "b", &journal);
  delete Find(*world, "a");
  delete Find(*world, "b");
  Step(*world, 3);
  EXPECT_EQ(journal.Text(), "");
}

// ---- quitting and the clock ---------------------------------------------------------------------

TEST(QuitTime, IsRoundedUpToWholeSteps) {
  struct {
    const char* text;
    size_t steps;
  } const cases[] = {{"quit_time 0.2", 2},
                     {"quit_time 0.25", 3},
                     {"quit_time 0.3", 3},
                     {"interval_sim 33.333 quit_time 0.1", 4},
                     {"interval_sim 50 quit_time 1", 20},
                     {"quit_time 0", 1000},
                     {"quit_time -1", 1000},
                     {"quit_time 0.0000001", 1000}};
  for (const auto& c : cases) {
    const auto world = LoadText(c.text);
    EXPECT_EQ(StepsUntilDone(*world), c.steps) << c.text;
    const usec_t then = world->SimTimeNow();
    EXPECT_EQ(world->Update(), c.steps < 1000);
    EXPECT_EQ(world->SimTimeNow() == then, c.steps < 1000);
  }
}

TEST(QuitTime, CanBeSet) {
  const auto world = LoadText("");
  world->SetQuitTime(300000);
  EXPECT_EQ(world->GetQuitTime(), 300000u);
  EXPECT_EQ(StepsUntilDone(*world), 3u);
  EXPECT_TRUE(world->PastQuitTime());
  EXPECT_FALSE(world->TestQuit());
}

TEST(Clock, StepsAreWholeMicroseconds) {
  const auto world = LoadText("interval_sim 33.3333");
  Step(*world, 3);
  EXPECT_EQ(world->SimTimeNow(), 99999u);
  EXPECT_EQ(world->GetUpdateCount(), 3u);
  EXPECT_EQ(world->sim_interval, 33333u);
}

TEST(Clock, Text) {
  const auto world = LoadText("");
  EXPECT_EQ(world->ClockString(), " 0m 00s 000msec");
  Step(*world, 12);
  EXPECT_EQ(world->ClockString(), " 0m 01s 200msec");
  world->sim_interval = usec_t{1000000} * (3600 * 2 + 60 * 3 + 4);
  Step(*world);
  EXPECT_EQ(world->ClockString(), "2h 3m 05s 200msec");
  world->sim_interval = usec_t{1000000} * 3600 * 98;
  Step(*world);
  EXPECT_EQ(world->ClockString(), "100h 3m 05s 200msec");
}

TEST(Clock, IsPrintedAtItsInterval) {
  std::vector<std::string> told;
  const auto world = LoadText("show_clock_interval 3");
  const auto every = LoadText("show_clock 1 show_clock_interval 0");
  SetLogSink([&](LogLevel, const std::string& line) { told.push_back(line); });
  Step(*world, 4);
  EXPECT_EQ(told, std::vector<std::string>());
  world->ShowClock(true);
  Step(*world, 6);
  EXPECT_EQ(told,
            (std::vector<std::string>{"[Stage:  0m 00s 600msec]", "[Stage:  0m 00s 900msec]"}));
  told.clear();
  EXPECT_TRUE(every->ShowsClock());
  Step(*every, 2);
  EXPECT_EQ(told,
            (std::vector<std::string>{"[Stage:  0m 00s 000msec]", "[Stage:  0m 00s 100msec]"}));
  SetLogSink(nullptr);
}

TEST(Quit, StopsAWorldUntilItIsCancelled) {
  const auto world = LoadText("");
  world->Quit();
  EXPECT_TRUE(world->TestQuit());
  EXPECT_TRUE(world->Update());
  EXPECT_EQ(world->GetUpdateCount(), 0u);
  world->CancelQuit();
  EXPECT_FALSE(world->TestQuit());
  EXPECT_FALSE(world->Update());
}

TEST(Quit, QuitAllStopsAllWorlds) {
  const auto one = LoadText(""), other = LoadText("");
  one->QuitAll();
  EXPECT_TRUE(one->TestQuit() && other->TestQuit());
  EXPECT_TRUE(other->Update());
  EXPECT_TRUE(World::UpdateAll());
  other->CancelQuitAll();
  EXPECT_FALSE(one->Update());
}

TEST(Quit, FromAControllerTakesEffectAfterTheStep) {
  const auto world = LoadText("model( name \"a\" alwayson 1 )");
  Find(*world, "a")
      ->AddCallback(
          Model::CB_UPDATE, [](Model* mod, void*) { return mod->GetWorld()->Quit(), 0; }, nullptr);
  EXPECT_EQ(StepsUntilDone(*world), 1u);
}

}  // namespace
}  // namespace Stg
