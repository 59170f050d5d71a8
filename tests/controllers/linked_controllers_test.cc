// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers that are linked into the program.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/model_testing.hh"

namespace {

using namespace Stg;

std::vector<std::string> calls;  // models and arguments

int NoteCall(Model* model, CtrlArgs* arguments) {
  calls.push_back(model->TokenStr() + ": " + arguments->worldfile);
  return 0;
}

int FailTest(Model*, CtrlArgs*) {
  ADD_FAILURE() << "the second controller of that name was called";
  return 0;
}

TEST(LinkedControllers, AreCalledByNameAndTheSecondOneOfANameIsRefused) {
  ASSERT_TRUE(RegisterController("linked", NoteCall));
  EXPECT_FALSE(RegisterController("linked", FailTest));
  EXPECT_TRUE(TryToLoad("model( name \"m\" ctrl \"linked 5\" )\n").loaded);
  EXPECT_EQ(calls, std::vector<std::string>{"m: linked 5"});
}

TEST(LinkedControllers, TakePrecedenceOverPlugins) {
  ASSERT_TRUE(RegisterController("/no/such/plugin", NoteCall));
  calls.clear();
  EXPECT_TRUE(TryToLoad("model( name \"m\" ctrl \"/no/such/plugin\" )\n").loaded);
  EXPECT_EQ(calls.size(), 1u);
}

#ifdef STAGE_STATIC
TEST(LinkedControllers, OfExamplesAreInStaticBuilds) {
  EXPECT_TRUE(TryToLoad("model( name \"m\" ctrl \"rasterize\" )\n").loaded);
}
#endif

}  // namespace
