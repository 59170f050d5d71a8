// SPDX-License-Identifier: GPL-2.0-or-later
//
// Bitmaps of a world file whose pictures are in memory: RunOptions::pictures.

#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>

#include "recording/world_files.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

constexpr char kPicture[] = "P1\n4 3\n1111\n1001\n1111\n";
constexpr char kWorld[] =
    "model( name \"walls\" bitmap \"some/walls.pbm\" size [4 3 1] )\n"
    "model( bitmap \"some/walls.pbm\" pose [9 0 0 0] )\n"
    "position( ranger( sensor( range [0 5] ) alwayson 1 ) )\n";

RunOptions WithPicture(const std::string& name, const std::string& content) {
  RunOptions options = OptionsOf(1);
  options.pictures = std::make_shared<const std::map<std::string, std::string>>(
      std::map<std::string, std::string>{{name, content}});
  return options;
}

bool LoadKept(World* world) {
  std::istringstream content(kWorld);
  return world->Load(content, "kept.world");
}

TEST(PicturesInMemory, EqualFiles) {
  InitLibrary();
  const std::string path = testing::TempDir() + "pictures_in_memory_test.pbm";
  std::ofstream(path) << kPicture;
  std::string text = kWorld;
  for (size_t at = 0; (at = text.find("some/walls.pbm")) != std::string::npos;)
    text.replace(at, std::string("some/walls.pbm").size(), path);
  World from_file(OptionsOf(1)), from_memory(WithPicture("some/walls.pbm", kPicture));
  std::istringstream content(text);
  ASSERT_TRUE(from_file.Load(content, "kept.world"));
  ASSERT_TRUE(LoadKept(&from_memory));
  for (int step = 0; step < 5; step++) {
    from_file.Update();
    from_memory.Update();
    EXPECT_EQ(from_memory.StateHash(), from_file.StateHash());
  }
}

TEST(PicturesInMemory, ServeCopiesAndResets) {
  InitLibrary();
  World world(WithPicture("some/walls.pbm", kPicture));
  ASSERT_TRUE(LoadKept(&world));
  World copy(world.options());
  EXPECT_TRUE(copy.LoadCopy(world));
  EXPECT_TRUE(world.Reset(1));
  EXPECT_TRUE(copy.Reset(1));
  EXPECT_EQ(copy.StateHash(), world.StateHash());
}

TEST(PicturesInMemory, OthersAreFiles) {
  InitLibrary();
  World world(WithPicture("another.pbm", kPicture));
  const std::string errors = ErrorsOf([&] { EXPECT_FALSE(LoadKept(&world)); });
  EXPECT_NE(errors.find("some/walls.pbm: cannot open the picture"), std::string::npos) << errors;
}

TEST(PicturesInMemory, AreRefusedIfDamaged) {
  InitLibrary();
  World world(WithPicture("some/walls.pbm", "P1\n4"));
  EXPECT_EQ(ErrorsOf([&] { EXPECT_FALSE(LoadKept(&world)); }),
            "kept.world:1:28: some/walls.pbm: the file is cut short\n");
}

TEST(PicturesInMemory, AreInLogs) {
  InitLibrary();
  World world(WithPicture("some/walls.pbm", kPicture));
  ASSERT_TRUE(LoadKept(&world));
  const std::vector<recording::WorldFile> files = recording::FilesOf(&world);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].name, "kept.world");
  EXPECT_EQ(files[1].name, "some/walls.pbm");
  EXPECT_EQ(files[1].content, kPicture);
}

}  // namespace
}  // namespace Stg
