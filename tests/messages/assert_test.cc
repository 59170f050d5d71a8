// SPDX-License-Identifier: GPL-2.0-or-later
//
// STAGE_ASSERT and its handler.

#include "messages/assert.hh"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "support/failed_assertions.hh"

namespace Stg {
namespace {

int evaluations = 0;
bool Evaluate(bool result) {
  evaluations++;
  return result;
}

// The macro follows STAGE_ASSERTIONS at each inclusion of its header, so both forms can be tested
// in every build.
#pragma push_macro("STAGE_ASSERTIONS")
#undef STAGE_ASSERTIONS
#define STAGE_ASSERTIONS 1
#include "messages/assert.hh"

TEST(AssertTest, CallsTheHandlerIfTheConditionIsFalse) {
  const test::FailedAssertions failed;
  STAGE_ASSERT(Evaluate(true));
  EXPECT_EQ(failed.Text(), "");
  const int line = __LINE__ + 1;
  STAGE_ASSERT(Evaluate(false));
  EXPECT_EQ(failed.Text(),
            std::string(__FILE__) + ":" + std::to_string(line) + ": Evaluate(false)\n");
}

TEST(AssertTest, EvaluatesTheConditionOnce) {
  const test::FailedAssertions failed;
  evaluations = 0;
  STAGE_ASSERT(Evaluate(true));
  STAGE_ASSERT(Evaluate(false));
  EXPECT_EQ(evaluations, 2);
}

TEST(AssertTest, AcceptsConditionsWithCommas) {
  const test::FailedAssertions failed;
  STAGE_ASSERT(std::vector<int>{1, 2}.size() == 2 && std::max(1, 2) == 2);
  EXPECT_EQ(failed.Text(), "");
}

TEST(AssertTest, IsAnExpression) {
  const test::FailedAssertions failed;
  const int value = (STAGE_ASSERT(false), 7);
  EXPECT_EQ(value, 7);
  EXPECT_NE(failed.Text(), "");
}

TEST(AssertTest, HandlerMayThrow) {
  const AssertHandler before = SetAssertHandler(
      [](const char*, int, const char* condition) { throw std::logic_error(condition); });
  EXPECT_THROW(STAGE_ASSERT(1 > 2), std::logic_error);
  SetAssertHandler(before);
}

TEST(AssertTest, SetAssertHandlerReturnsThePreviousHandler) {
  const AssertHandler mine = [](const char*, int, const char*) {};
  EXPECT_EQ(SetAssertHandler(mine), nullptr);
  EXPECT_EQ(SetAssertHandler(nullptr), mine);
  EXPECT_EQ(SetAssertHandler(nullptr), nullptr);
}

TEST(AssertDeathTest, DefaultHandlerPrintsOneLineAndAborts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(STAGE_ASSERT(2 + 2 == 5), testing::KilledBySignal(SIGABRT),
              "tests/messages/assert_test.cc:[0-9]+: assertion failed: 2 \\+ 2 == 5\n$");
}

#undef STAGE_ASSERTIONS
#define STAGE_ASSERTIONS 0
#include "messages/assert.hh"

TEST(AssertTest, WithoutAssertionsTheConditionIsNotEvaluated) {
  const test::FailedAssertions failed;
  evaluations = 0;
  STAGE_ASSERT(Evaluate(false));
  EXPECT_EQ(evaluations, 0);
  EXPECT_EQ(failed.Text(), "");
}

TEST(AssertTest, WithoutAssertionsTheConditionIsAConstantExpression) {
  // A constexpr value needs no generated code.
  constexpr int kValue = (STAGE_ASSERT(Evaluate(false)), 7);
  EXPECT_EQ(kValue, 7);
}

#pragma pop_macro("STAGE_ASSERTIONS")

}  // namespace
}  // namespace Stg
