// SPDX-License-Identifier: GPL-2.0-or-later

#include "geometry/free_floor.hh"

#include <gtest/gtest.h>

namespace Stg::geometry {
namespace {

TEST(Discs, KeepApartHoweverFarOut) {
  for (const double far : {0.0, 1e6, 1e18, 1e19, 1e300, -1e19, -1e300}) {
    SCOPED_TRACE(far);
    Discs discs(0.5, 0.1);
    EXPECT_TRUE(discs.AddIfClear(point_t(far, -far), 0.5));
    EXPECT_FALSE(discs.AddIfClear(point_t(far, -far), 0.5));
  }
}

TEST(FreeFloor, IsFreeFarOut) {
  FreeFloor floor;
  floor.AddBody({{point_t(0, 0), point_t(1, 0), point_t(1, 1), point_t(0, 1)}});
  floor.BuildIndex(0.5);
  EXPECT_FALSE(floor.IsClear(point_t(0.5, 0.5), 0.1));
  for (const double far : {1e6, 1e19, 1e300, -1e19, -1e300})
    EXPECT_TRUE(floor.IsClear(point_t(far, far), 0.1)) << far;
}

}  // namespace
}  // namespace Stg::geometry
