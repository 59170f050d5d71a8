// SPDX-License-Identifier: GPL-2.0-or-later
//
// Clients write `using namespace Stg` and define their own names. The names of the library's
// modules must not conflict with them; otherwise this file would not compile.

#include <gtest/gtest.h>

#include "stage.hh"

using namespace Stg;

namespace {

double grid[4][4];
int sensing = 3;
const char* picture = "picture";

struct Random {
  int Next() { return ++state; }
  int state = 0;
};

struct Engine {
  Random random;
};

TEST(ClientNames, DoNotConflictWithTheLibrary) {
  Engine engine;
  grid[1][2] = 0.5;
  EXPECT_EQ(engine.random.Next() + sensing, 4);
  EXPECT_EQ(grid[1][2], 0.5);
  EXPECT_STREQ(picture, "picture");

  World world;
  EXPECT_EQ(world.SimTimeNow(), 0u);
}

}  // namespace
