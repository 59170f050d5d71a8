// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_BLOBFINDER_TESTING_HH
#define STAGE_TESTS_BLOBFINDER_TESTING_HH

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/model_testing.hh"

/// Helpers for tests of blobfinders.
namespace Stg {

using Blob = ModelBlobfinder::Blob;

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A world with a subscribed blobfinder "b" at the origin. Its image is 81 pixels wide, so ray 40
/// points straight ahead.
struct Scene {
  explicit Scene(const std::string& rest, const std::string& properties = "")
      : world(LoadText("blobfinder( name \"b\" image [81 60] " + properties + " )\n" + rest)),
        finder(FindRunning<ModelBlobfinder>(*world, "b")) {}
  const std::vector<Blob>& Blobs() {
    Step(*world);
    return finder->GetBlobs();
  }
  std::unique_ptr<World> world;
  ModelBlobfinder* finder;
};

/// A box straight ahead, two metres wide, with its near face at x = 2.5.
inline std::string Box(const std::string& color, const std::string& more = "") {
  return "model( name \"" + color + "\" color \"" + color + "\" pose [3 0 0 0] size [1 2 1] " +
         more + " )\n";
}

/// Two touching boxes 2.5 m away, the first to the right of the center, the second to the left.
inline std::string Neighbours(const std::string& right, const std::string& left) {
  return "model( " + right + " pose [3 -1 0 0] size [1 2 1] )\nmodel( " + left +
         " pose [3 1 0 0] size [1 2 1] )\n";
}

struct Expected {
  const char* color;
  unsigned left, top, right, bottom;
  double range, tolerance = 1.5 * kCell;
};
inline void ExpectBlobs(const std::vector<Blob>& blobs, const std::vector<Expected>& expected) {
  ASSERT_EQ(blobs.size(), expected.size());
  for (size_t i = 0; i < blobs.size(); i++) {
    const Expected& e = expected[i];
    EXPECT_EQ(blobs[i].color, Color(e.color)) << i;
    EXPECT_NEAR(blobs[i].left, e.left, 1) << e.color;
    EXPECT_NEAR(blobs[i].top, e.top, 1) << e.color;
    EXPECT_NEAR(blobs[i].right, e.right, 1) << e.color;
    EXPECT_NEAR(blobs[i].bottom, e.bottom, 1) << e.color;
    EXPECT_NEAR(blobs[i].range, e.range, e.tolerance) << e.color;
  }
}

inline void ExpectOneBlob(Scene* scene, const char* color) {
  const std::vector<Blob>& blobs = scene->Blobs();
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_EQ(blobs[0].color, Color(color));
}

}  // namespace Stg

#endif
