// SPDX-License-Identifier: GPL-2.0-or-later
//
// Selection of the colours that blobfinders detect.

#include <cmath>

#include "blobfinder_testing.hh"

namespace Stg {
namespace {

// ---- chosen colours -----------------------------------------------------------------------------

const char kThree[] =
    "model( color \"red\" pose [3 -1 0 0] size [0.4 0.4 1] )\n"
    "model( color \"green\" pose [3 0 0 0] size [0.4 0.4 1] )\n"
    "model( color \"blue\" pose [3 1 0 0] size [0.4 0.4 1] )\n";

std::string Seen(Scene* scene) {
  std::string text;
  for (const Blob& blob : scene->Blobs())
    text += blob.color == Color::red     ? 'r'
            : blob.color == Color::green ? 'g'
            : blob.color == Color::blue  ? 'b'
                                         : '?';
  return text;
}

TEST(Colors, AListInTheWorldFile) {
  const struct {
    const char *properties, *seen;
  } cases[] = {{"", "rgb"},
               {"colors [\"blue\" \"red\"] colors_count 2", "rb"},
               {"colors [\"blue\" \"red\"] colors_count 1", "b"},
               {"colors [\"blue\" \"red\"] colors_count 0", "rgb"},
               {"colors [\"blue\" \"red\"]", "rgb"},
               {"colors \"green\" colors_count 1", "g"},
               {"colors [\"yellow\"] colors_count 1", ""},
               {"colors [\"no such color\"] colors_count 1", "r"},
               {"colors_count 2", "rgb"}};
  for (const auto& c : cases) {
    Scene scene(kThree, c.properties);
    EXPECT_EQ(Seen(&scene), c.seen) << c.properties;
  }
}

TEST(Colors, WarnsOfDoubtfulLists) {
  const auto errors = [](const std::string& properties) {
    return TryToLoad("blobfinder( " + properties + " )").errors;
  };
  EXPECT_EQ(errors("colors [\"blue\"] colors_count 1"), "");
  EXPECT_EQ(errors("colors [\"blue\"] colors_count 0"), "");
  EXPECT_NE(errors("colors [\"blue\"]").find("t.world:1:"), std::string::npos);
  EXPECT_NE(errors("colors [\"blue\"]").find("colors_count"), std::string::npos);
  EXPECT_NE(errors("colors [\"bleu\"] colors_count 1").find("\"bleu\""), std::string::npos);
}

TEST(Colors, TheListCanBeChangedAtRunTime) {
  Scene scene(kThree);
  scene.finder->AddColor(Color::blue);
  EXPECT_EQ(Seen(&scene), "b");
  scene.finder->AddColor(Color::red);
  EXPECT_EQ(Seen(&scene), "rb");
  scene.finder->RemoveColor(Color::blue);
  EXPECT_EQ(Seen(&scene), "r");
  scene.finder->RemoveColor(Color::red);
  EXPECT_EQ(Seen(&scene), "rgb");
  scene.finder->AddColor(Color::green);
  scene.finder->RemoveAllColors();
  EXPECT_EQ(Seen(&scene), "rgb");
}

TEST(Colors, LoadingReplacesTheList) {
  Scene scene(kThree, "colors [\"blue\"] colors_count 1");
  scene.finder->AddColor(Color::red);
  EXPECT_EQ(Seen(&scene), "rb");
  scene.finder->Load();
  EXPECT_EQ(Seen(&scene), "b");
}

TEST(Colors, RemovingRemovesAllEqualColors) {
  Scene scene(kThree);
  for (const Color& c : {Color::blue, Color::blue, Color::green, Color::blue, Color::blue})
    scene.finder->AddColor(c);
  scene.finder->RemoveColor(Color::blue);
  EXPECT_EQ(Seen(&scene), "g");
  scene.finder->RemoveColor(Color(0, 1, 0, 0.5));  // another opacity is another colour
  EXPECT_EQ(Seen(&scene), "g");
  scene.finder->RemoveColor(Color(0.00005, 1, 0));
  EXPECT_EQ(Seen(&scene), "rgb");
  scene.finder->RemoveColor(Color::red);
  EXPECT_EQ(Seen(&scene), "rgb");
}

TEST(Colors, WorldFilesAreRefused) {
  for (const char* properties :
       {"colors [\"red\" \"blue\"] colors_count 3", "colors [\"red\"] colors_count -1"}) {
    const LoadOutcome outcome = TryToLoad("blobfinder( " + std::string(properties) + " )");
    EXPECT_FALSE(outcome.loaded) << properties;
    EXPECT_EQ(outcome.status, 255);
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
  }
  for (const char* properties : {"image [80]", "image [4000000000 60]", "range -1", "range \"inf\"",
                                 "fov \"nan\"", "pan \"inf\""}) {
    const LoadOutcome outcome = TryToLoad("blobfinder( " + std::string(properties) + " )");
    EXPECT_FALSE(outcome.loaded) << properties;
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
  }
}

}  // namespace
}  // namespace Stg
