// SPDX-License-Identifier: GPL-2.0-or-later
//
// The radio: its properties, and which messages are received when and where.

#include <cmath>
#include <string>

#include "radio_testing.hh"

namespace Stg {
namespace {

// ---- properties ---------------------------------------------------------------------------------

TEST(Radio, Defaults) {
  const auto world = LoadText("radio( name \"a\" )");
  const ModelRadio* radio = Find<ModelRadio>(*world, "a");
  EXPECT_EQ(radio->range, 1);
  EXPECT_FALSE(radio->line_of_sight);
  EXPECT_EQ(radio->delay, 0u);
  EXPECT_EQ(radio->channel, 0);
  EXPECT_EQ(radio->loss, 0);
  EXPECT_EQ(radio->range_noise, 0);
  EXPECT_EQ(radio->bearing_noise, 0);
  EXPECT_FALSE(radio->collisions);
  EXPECT_EQ(radio->capacity, 64u);
  EXPECT_EQ(radio->GetGeom().size.x, 0);
  EXPECT_FALSE(radio->vis.obstacle_return);
  EXPECT_LT(radio->vis.ranger_return, 0);
}

TEST(Radio, PropertiesAreReadInTheUnitsOfTheFile) {
  const auto world = LoadText(
      "unit_length \"cm\"\nradio( name \"a\" range 40 line_of_sight 1 delay 2 channel -3 loss "
      "0.25\n"
      "  range_noise 5 bearing_noise 180 collisions 1 capacity 7 )");
  const ModelRadio* radio = Find<ModelRadio>(*world, "a");
  EXPECT_DOUBLE_EQ(radio->range, 0.4);
  EXPECT_TRUE(radio->line_of_sight);
  EXPECT_EQ(radio->delay, 2u);
  EXPECT_EQ(radio->channel, -3);
  EXPECT_EQ(radio->loss, 0.25);
  EXPECT_DOUBLE_EQ(radio->range_noise, 0.05);
  EXPECT_DOUBLE_EQ(radio->bearing_noise, M_PI);
  EXPECT_TRUE(radio->collisions);
  EXPECT_EQ(radio->capacity, 7u);
}

TEST(Radio, InvalidPropertiesAreErrors) {
  const std::pair<const char*, const char*> kCases[] = {
      {"loss 1.5", "found a probability that is not between 0 and 1"},
      {"loss -0.1", "found a probability that is not between 0 and 1"},
      {"range -1", "found a negative number, expected 0 or more"},
      {"range_noise -1", "found a negative number, expected 0 or more"},
      {"bearing_noise -1", "found a negative number, expected 0 or more"},
      {"delay -1", "found -1, expected 0 or more"},
      {"capacity 0", "found 0, expected 1 or more"}};
  for (const auto& [property, message] : kCases) {
    const LoadOutcome outcome = TryToLoad("radio( " + std::string(property) + " )");
    EXPECT_FALSE(outcome.loaded) << property;
    EXPECT_NE(outcome.errors.find(message), std::string::npos) << property << outcome.errors;
  }
}

// ---- sending ------------------------------------------------------------------------------------

TEST(Radio, AMessageIsReceivedOnceInTheNextStep) {
  Pair pair;
  EXPECT_TRUE(SendText(pair.a, "hi"));
  EXPECT_EQ(Heard(*pair.b), "");
  EXPECT_EQ(pair.a->GetSendingCount(), 1u);
  Step(*pair.world);
  EXPECT_EQ(Heard(*pair.b), "hi");
  EXPECT_EQ(pair.a->GetSendingCount(), 0u);
  Step(*pair.world);
  EXPECT_EQ(Heard(*pair.b), "");
}

TEST(Radio, AMessageSaysWhoSentItWhenAndFromWhere) {
  Pair pair("", "", "");
  Step(*pair.world, 3);
  pair.Pass();
  ASSERT_EQ(pair.b->Received().size(), 1u);
  const ModelRadio::Message& message = pair.b->Received()[0];
  EXPECT_EQ(message.sender, pair.a->GetId());
  EXPECT_EQ(message.sent, 300000u);
  EXPECT_DOUBLE_EQ(message.range, 5);
  EXPECT_NEAR(message.bearing, std::atan2(-4, -3), 1e-15);
}

TEST(Radio, MessagesHaveUpToSixtyFourBytes) {
  Pair pair;
  EXPECT_EQ(pair.Pass(std::string(64, 'x')), std::string(64, 'x'));
  const std::string zeros("a\0b", 3);
  EXPECT_EQ(pair.Pass(zeros), zeros);
  EXPECT_TRUE(pair.a->Send(nullptr, 0));
  Step(*pair.world);
  ASSERT_EQ(pair.b->Received().size(), 1u);
  EXPECT_EQ(pair.b->Received()[0].size, 0u);
}

TEST(Radio, LongerMessagesAreRefused) {
  Pair pair;
  const std::string errors =
      ErrorsOf([&] { EXPECT_FALSE(SendText(pair.a, std::string(65, 'x'))); });
  EXPECT_EQ(errors,
            "stage: \"a\": found a message of 65 bytes, expected at most 64; send it in several "
            "parts\n");
  EXPECT_EQ(pair.a->GetSendingCount(), 0u);
}

TEST(Radio, SeveralMessagesArriveInTheOrderOfSending) {
  Pair pair;
  SendText(pair.a, "one");
  EXPECT_EQ(pair.Pass("two"), "one two");
}

TEST(Radio, OnlyRunningRadiosReceive) {
  Pair pair;
  pair.b->Unsubscribe();
  EXPECT_EQ(pair.Pass(), "");
  EXPECT_EQ(pair.a->GetSendingCount(), 0u);
  pair.b->Subscribe();
  Step(*pair.world);
  EXPECT_EQ(Heard(*pair.b), "") << "the message was lost while the radio did not run";
  EXPECT_EQ(pair.Pass(), "hi");
  pair.b->Unsubscribe();
  EXPECT_EQ(Heard(*pair.b), "");
}

// ---- who hears ----------------------------------------------------------------------------------

TEST(Radio, TheRangeOfTheSenderCounts) {
  Pair pair("", "range 0");
  for (const double range : {5.0, 100.0, HUGE_VAL}) {
    pair.a->range = range;
    EXPECT_EQ(pair.Pass(), "hi") << range;
  }
  for (const double range : {4.999, 0.0, -1.0, static_cast<double>(NAN)}) {
    pair.a->range = range;
    EXPECT_EQ(pair.Pass(), "") << range;
  }
}

TEST(Radio, ARangeOfZeroReachesTheSamePlace) {
  Pair pair;
  pair.a->range = 0;
  pair.a->SetPose(pair.b->GetPose());
  EXPECT_EQ(pair.Pass(), "hi");
  EXPECT_EQ(pair.b->Received()[0].range, 0);
}

TEST(Radio, HeightsDoNotCount) {
  Pair pair;
  pair.a->SetPose(Pose(0, 0, 7, 0));
  EXPECT_EQ(pair.Pass(), "hi");
  EXPECT_EQ(pair.b->Received()[0].range, 5);
}

TEST(Radio, RadiosOfTheSameTreeDoNotHearEachOther) {
  const auto world = LoadText("position( name \"r\" " + Radio("a", 0, 0) + Radio("b", 0, 0) + ")" +
                              Radio("c", 0.5, 0));
  auto *a = FindRunning<ModelRadio>(*world, "r.a"), *b = FindRunning<ModelRadio>(*world, "r.b"),
       *c = FindRunning<ModelRadio>(*world, "c");
  SendText(a, "hi");
  Step(*world);
  EXPECT_EQ(Heard(*a) + Heard(*b), "");
  EXPECT_EQ(Heard(*c), "hi");
}

TEST(Radio, OnlyEqualChannelsHearEachOther) {
  Pair pair("", "channel 4");
  EXPECT_EQ(pair.Pass(), "");
  pair.a->channel = 4;
  EXPECT_EQ(pair.Pass(), "hi");
  SendText(pair.a, "four");
  pair.a->channel = 5;  // concerns later messages only
  EXPECT_EQ(pair.Pass("five"), "four");
}

TEST(Radio, DelaysAreStepsInAdditionToTheUsualOne) {
  for (const unsigned delay : {0u, 1u, 4u}) {
    Pair pair("delay " + std::to_string(delay));
    Step(*pair.world, 2);
    SendText(pair.a, "hi");
    for (unsigned step = 0; step <= delay; step++) {
      EXPECT_EQ(Heard(*pair.b), "") << delay;
      Step(*pair.world);
    }
    EXPECT_EQ(Heard(*pair.b), "hi") << delay;
    EXPECT_EQ(pair.b->Received()[0].sent, 200000u);
    Step(*pair.world);
    EXPECT_EQ(Heard(*pair.b), "") << delay;
  }
}

TEST(Radio, AShorterDelayOvertakes) {
  Pair pair("delay 2");
  SendText(pair.a, "late");
  pair.a->delay = 0;
  EXPECT_EQ(pair.Pass("early"), "early");
  Step(*pair.world, 2);
  EXPECT_EQ(Heard(*pair.b), "late");
}

TEST(Radio, SlowRadiosReportTheMessagesOfAllSteps) {
  Pair pair("", "update_interval 300");
  EXPECT_EQ(pair.Pass("one"), "");
  EXPECT_EQ(pair.Pass("two"), "");
  EXPECT_EQ(pair.Pass("three"), "one two three");
  EXPECT_EQ(pair.Pass("four"), "one two three") << "until the next update";
}

TEST(Radio, CollidingMessagesAreNotHeard) {
  Pair pair("", "collisions 1", Radio("c", 3, 5, "range 10") + Radio("d", 3, 5, "channel 1"));
  auto *c = Find<ModelRadio>(*pair.world, "c"), *d = Find<ModelRadio>(*pair.world, "d");
  SendText(c, "c");
  EXPECT_EQ(pair.Pass(), "");
  SendText(c, "c");
  SendText(c, "c2");
  Step(*pair.world);
  EXPECT_EQ(Heard(*pair.b), "c c2") << "one sender does not disturb itself";
  SendText(d, "d");
  EXPECT_EQ(pair.Pass(), "hi") << "another channel does not disturb";
  c->range = 0.5;
  SendText(c, "c");
  EXPECT_EQ(pair.Pass(), "hi") << "a sender out of range does not disturb";
  pair.b->collisions = false;
  c->range = 10;
  SendText(c, "c");
  EXPECT_EQ(pair.Pass(), "c hi");
}

/// While c sends on another channel, its message for this one is still on the way.
TEST(Radio, MessagesThatAreNotDueDoNotCollide) {
  Pair pair("", "collisions 1", Radio("c", 3, 5, "range 10 delay 2"));
  auto* c = Find<ModelRadio>(*pair.world, "c");
  SendText(c, "late");
  c->delay = 0;
  c->channel = 1;
  SendText(c, "other");
  EXPECT_EQ(pair.Pass(), "hi");
}

TEST(Radio, MessagesCollideEvenIfTheyWouldBeLost) {
  Pair pair("", "collisions 1 loss 0.5", Radio("c", 3, 5, "range 10"));
  auto* c = Find<ModelRadio>(*pair.world, "c");
  for (int i = 0; i < 50; i++) {
    SendText(c, "c");
    EXPECT_EQ(pair.Pass(), "");
  }
}

TEST(Radio, TheNearestMessagesFillTheCapacity) {
  Pair pair("", "capacity 2",
            Radio("c", 3, 4.5, "range 10") + Radio("d", 3, 6, "range 10") +
                Radio("e", 3, 3.5, "range 10"));
  for (const char* name : {"d", "e", "c"}) SendText(Find<ModelRadio>(*pair.world, name), name);
  EXPECT_EQ(pair.Pass(), "c e") << "c and e are equally near; c was created first";
  SendText(pair.a, "x");
  SendText(pair.a, "y");
  EXPECT_EQ(pair.Pass("z"), "x y");
}

TEST(Radio, LostMessagesDoNotUseTheCapacity) {
  Pair pair("", "capacity 1 loss 0.5");
  int heard = 0;
  for (int i = 0; i < 200; i++) {
    for (int k = 0; k < 9; k++) SendText(pair.a, "x");
    heard += pair.Pass("x") == "x";
  }
  EXPECT_GE(heard, 197);  // each time with a probability of 1023 / 1024
}

TEST(Radio, MessagesOfADeletedRadioAreLost) {
  Pair pair;
  SendText(pair.a, "hi");
  delete pair.a;
  Step(*pair.world);
  EXPECT_EQ(Heard(*pair.b), "");
  EXPECT_EQ(pair.world->Validate(), "");
}

TEST(Radio, ReceivedMessagesOutliveTheirSender) {
  Pair pair;
  EXPECT_EQ(pair.Pass(), "hi");
  const uint32_t id = pair.a->GetId();
  delete pair.a;
  EXPECT_EQ(Heard(*pair.b), "hi");
  EXPECT_EQ(pair.b->Received()[0].sender, id);
}

TEST(Radio, AControllersMessageArrivesInTheNextStep) {
  Pair pair;
  struct Answer {
    static int Call(Model* model, void*) {
      auto* radio = static_cast<ModelRadio*>(model);
      if (radio->Received().empty()) return 0;
      SendText(radio, "re:" + TextOf(radio->Received()[0]));
      return 0;
    }
  };
  pair.b->range = 10;
  pair.a->Subscribe();
  pair.b->AddCallback(Model::CB_UPDATE, Answer::Call, nullptr);
  EXPECT_EQ(pair.Pass(), "hi");
  EXPECT_EQ(Heard(*pair.a), "");
  Step(*pair.world);
  EXPECT_EQ(Heard(*pair.a), "re:hi");
  EXPECT_EQ(pair.a->Received()[0].sent, 100000u);
}

// ---- poses --------------------------------------------------------------------------------------

/// Range and bearing belong to the poses before the moves of the step of reception.
TEST(Radio, MeasuresAtTheInstantOfReception) {
  const auto world = LoadText("position( name \"r\" pose [0 0 0 90] alwayson 1 " +
                              Radio("a", 0, 0, "range 10 delay 1") + ")" + Radio("b", 0, -2));
  auto *a = Find<ModelRadio>(*world, "r.a"), *b = FindRunning<ModelRadio>(*world, "b");
  Find<ModelPosition>(*world, "r")->SetSpeed(1, 0, 0);
  SendText(a, "hi");
  Step(*world, 2);
  ASSERT_EQ(b->Received().size(), 1u);
  EXPECT_DOUBLE_EQ(b->Received()[0].range, 2.1) << "after the move of the first step";
  EXPECT_DOUBLE_EQ(a->GetGlobalPose().y, 0.2);
}

TEST(Radio, BearingsAreRelativeToTheRadioInItsTree) {
  for (const double turn : {0.0, 30.0, 170.0, -100.0}) {
    const auto world =
        LoadText("model( name \"m\" pose [1 2 0 " + std::to_string(turn) +
                 "] radio( name \"a\" pose [0.5 0.1 0 40] ) )" + Radio("b", -3, 1, "range 10"));
    auto *a = FindRunning<ModelRadio>(*world, "m.a"), *b = Find<ModelRadio>(*world, "b");
    SendText(b, "hi");
    Step(*world);
    const double t = turn * M_PI / 180;
    const double x = 1 + 0.5 * std::cos(t) - 0.1 * std::sin(t);
    const double y = 2 + 0.5 * std::sin(t) + 0.1 * std::cos(t);
    ASSERT_EQ(a->Received().size(), 1u);
    EXPECT_NEAR(a->Received()[0].range, std::hypot(-3 - x, 1 - y), 1e-12);
    const double bearing = std::atan2(1 - y, -3 - x) - t - 40 * M_PI / 180;
    EXPECT_NEAR(std::remainder(a->Received()[0].bearing - bearing, 2 * M_PI), 0, 1e-12) << turn;
    EXPECT_LE(std::fabs(a->Received()[0].bearing), M_PI);
  }
}

// ---- line of sight ------------------------------------------------------------------------------

std::string Wall(const std::string& properties = "") {
  return "model( name \"wall\" pose [1.5 2 0 0] size [1 1 1] " + properties + " )\n";
}

TEST(Radio, BodiesBlockMessagesOnlyWithLineOfSight) {
  EXPECT_EQ(Pair("", "line_of_sight 1", Wall()).Pass(), "hi") << "that of the receiver";
  EXPECT_EQ(Pair("line_of_sight 1", "", Wall()).Pass(), "");
  EXPECT_EQ(Pair("line_of_sight 1", "").Pass(), "hi");
}

TEST(Radio, BodiesThatRangersDoNotSeeDoNotBlock) {
  EXPECT_EQ(Pair("line_of_sight 1", "", Wall("ranger_return -1")).Pass(), "hi");
  Pair pair("line_of_sight 1", "", Wall("obstacle_return 0"));
  EXPECT_EQ(pair.Pass(), "");
  Find(*pair.world, "wall")->vis.ranger_return = -1;
  EXPECT_EQ(pair.Pass(), "hi");
  Find(*pair.world, "wall")->vis.ranger_return = 0.5;
  EXPECT_EQ(pair.Pass(), "");
}

TEST(Radio, TheRayIsAtTheHeightOfTheSender) {
  Pair pair("line_of_sight 1", "", Wall());
  pair.a->SetPose(Pose(0, 0, 1.1, 0));
  EXPECT_EQ(pair.Pass(), "hi");
  pair.a->SetPose(Pose(0, 0, 0.9, 0));
  pair.b->SetPose(Pose(3, 4, 5, 0));
  EXPECT_EQ(pair.Pass(), "");
}

TEST(Radio, BothTreesDoNotBlock) {
  const auto tree = [](const std::string& name, double x) {
    return "model( name \"" + name + "\" pose [" + std::to_string(x) +
           " 0 0 0] size [0.5 0.5 1] model( size [0.9 0.9 1] pose [0 0 -1 0] ) " +
           "radio( name \"a\" pose [0 0 -0.5 0] range 9 line_of_sight 1 alwayson 1 ) )\n";
  };
  const auto world = LoadText(tree("m", 0) + tree("n", 2) + tree("o", 4));
  SendText(Find<ModelRadio>(*world, "m.a"), "hi");
  Step(*world);
  EXPECT_EQ(Heard(*Find<ModelRadio>(*world, "n.a")), "hi");
  EXPECT_EQ(Heard(*Find<ModelRadio>(*world, "o.a")), "") << "n is in between";
}

TEST(Radio, ABodyBehindTheSenderDoesNotBlock) {
  EXPECT_EQ(Pair("line_of_sight 1", "", "model( pose [-0.5 -0.5 0 0] size [0.4 0.4 1] )").Pass(),
            "hi");
}

}  // namespace
}  // namespace Stg
