// SPDX-License-Identifier: GPL-2.0-or-later
//
// Fields: their cells, values at places, and properties.

#include <cmath>
#include <fstream>
#include <limits>

#include "models/types/field_evolution.hh"
#include "recording/world_files.hh"
#include "support/model_testing.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

/// Four columns of 0.5 m, and three rows of 1 m, whose values are 0, 1, 2 ... 11.
const char kNumbered[] = "field( name \"f\" size [2 3 0] field_resolution 0.5 )\n";

void Number(ModelField* field) {
  std::vector<double> values(field->values().size());
  for (size_t i = 0; i < values.size(); i++) values[i] = static_cast<double>(i);
  ASSERT_TRUE(field->SetValues(values.data(), values.size()));
}

TEST(Field, HasTheCellsThatFillItsSize) {
  const auto world = LoadText(
      "field( name \"a\" size [2 3 0] field_resolution 0.5 )\n"
      "field( name \"b\" size [1 0.7 0] field_resolution 0.4 )\n"
      "field( name \"c\" )\nfield( name \"d\" size [0.3 0.6 0] field_resolution 0.1 )\n");
  const auto expect = [&](const char* name, size_t columns, size_t rows) {
    EXPECT_EQ(Find<ModelField>(*world, name)->columns(), columns) << name;
    EXPECT_EQ(Find<ModelField>(*world, name)->rows(), rows) << name;
  };
  expect("a", 4, 6);
  expect("b", 3, 2);
  expect("c", 20, 20);
  expect("d", 3, 6);
  EXPECT_DOUBLE_EQ(Find<ModelField>(*world, "b")->CellWidth(), 1.0 / 3);
  EXPECT_DOUBLE_EQ(Find<ModelField>(*world, "b")->CellHeight(), 0.35);
}

TEST(Field, HasNoBodyThatOthersPerceive) {
  const auto world = LoadText(
      "field( size [4 4 0] )\nposition( name \"r\" pose [-1 0 0 0] size [0.2 0.2 0.2]\n"
      "  alwayson 1 ranger( name \"eye\" sensor( range [0 3] samples 3 ) "
      "alwayson 1 ) )\n");
  Find<ModelPosition>(*world, "r")->SetSpeed(1, 0, 0);
  Step(*world, 10);
  EXPECT_GT(Find(*world, "r")->GetPose().x, -0.2);
  for (const double range : Find<ModelRanger>(*world, "r.eye")->GetSensors()[0].ranges)
    EXPECT_EQ(range, 3);
}

// ---- reading and writing ------------------------------------------------------------------------

TEST(Field, RowsAreCountedFromTheSouth) {
  const auto world = LoadText(kNumbered);
  auto* const field = Find<ModelField>(*world, "f");
  Number(field);
  EXPECT_EQ(field->NearestValue(-0.75, -1.25), 0);
  EXPECT_EQ(field->NearestValue(0.75, -1.25), 3);
  EXPECT_EQ(field->NearestValue(-0.75, 1.25), 20);
  EXPECT_EQ(field->NearestValue(1, 1.5), 23) << "the edge belongs to the field";
  EXPECT_EQ(field->NearestValue(1.001, 1.5), 0);
  EXPECT_EQ(field->NearestValue(NAN, 0), 0);
}

/// A bilinear function of the place in the field's frame.
double Slope(double x, double y) { return 3 + 2 * x - y + 0.5 * x * y; }

TEST(Field, ReadsBilinearFunctionsExactlyAtAnyPose) {
  for (const char* pose : {"[0 0 0 0]", "[3 -2 0 0]", "[1 2 0 90]", "[-5 7 0 33]"}) {
    const auto world = LoadText(
        std::string("field( name \"f\" size [4 3 0] field_resolution 0.25 pose ") + pose + " )\n");
    auto* const field = Find<ModelField>(*world, "f");
    std::vector<double> values;
    for (size_t row = 0; row < field->rows(); row++)
      for (size_t column = 0; column < field->columns(); column++)
        values.push_back(Slope(-1.875 + 0.25 * static_cast<double>(column),
                               -1.375 + 0.25 * static_cast<double>(row)));
    ASSERT_TRUE(field->SetValues(values.data(), values.size()));
    for (double x = -1.87; x < 1.87; x += 0.173)
      for (double y = -1.37; y < 1.37; y += 0.191) {
        const Pose at = field->GetPose() + Pose(x, y, 0, 0);
        EXPECT_NEAR(field->LinearValue(at.x, at.y), Slope(x, y), 1e-12) << pose;
      }
    const Pose corner = field->GetPose() + Pose(-1.99, -1.49, 0, 0);
    EXPECT_NEAR(field->LinearValue(corner.x, corner.y), values[0], 1e-12) << "beyond the middles";
    const Pose outside = field->GetPose() + Pose(-2.01, 0, 0, 0);
    EXPECT_EQ(field->LinearValue(outside.x, outside.y), 0);
  }
}

TEST(Field, OriginMovesItsCells) {
  const auto world = LoadText(
      "field( name \"f\" size [2 2 0] field_resolution 1 origin [10 0 0 0] pose [1 0 0 0] )\n");
  auto* const field = Find<ModelField>(*world, "f");
  EXPECT_FALSE(field->SetValue(1, 0, 5));
  EXPECT_TRUE(field->SetValue(11.5, 0.5, 5));
  EXPECT_EQ(field->values()[3], 5);
}

TEST(Field, ADepositIncreasesTheIntegral) {
  const auto world = LoadText(kNumbered);
  auto* const field = Find<ModelField>(*world, "f");
  EXPECT_TRUE(field->Deposit(0.1, 0.1, 2));
  EXPECT_DOUBLE_EQ(field->NearestValue(0.1, 0.1), 2 / 0.25);
  EXPECT_TRUE(field->Deposit(0.1, 0.1, -0.5));
  EXPECT_DOUBLE_EQ(field->Integral(), 1.5);
  EXPECT_FALSE(field->Deposit(9, 0, 2)) << "outside";
  EXPECT_FALSE(field->Deposit(0, 0, INFINITY));
  EXPECT_DOUBLE_EQ(field->Integral(), 1.5);
}

TEST(Field, RefusesInvalidValues) {
  const auto world = LoadText(kNumbered);
  auto* const field = Find<ModelField>(*world, "f");
  std::vector<double> values(24, 1);
  EXPECT_FALSE(field->SetValues(values.data(), 23));
  values[23] = NAN;
  EXPECT_FALSE(field->SetValues(values.data(), 24));
  EXPECT_FALSE(field->SetValue(0, 0, 1e101));
  EXPECT_EQ(field->Integral(), 0);
  EXPECT_TRUE(field->SetValue(0, 0, 1e-31));
  EXPECT_EQ(field->Integral(), 0) << "nearer to 0 than kSmallest";
  for (int i = 0; i < 3; i++) EXPECT_TRUE(field->Deposit(0, 0, 1e308));
  EXPECT_EQ(field->NearestValue(0, 0), ModelField::kLargest);
  EXPECT_FALSE(field->SetDiffusion(-1));
  EXPECT_FALSE(field->SetEvaporation(NAN));
}

// ---- properties ---------------------------------------------------------------------------------

TEST(Field, PropertiesAreRead) {
  const auto world =
      LoadText("field( name \"f\" initial 20.5 diffusion 0.001 evaporation 0.1 edge \"open\" )\n");
  const auto* const field = Find<ModelField>(*world, "f");
  EXPECT_EQ(field->values()[399], 20.5);
  EXPECT_EQ(field->diffusion(), 0.001);
  EXPECT_EQ(field->evaporation(), 0.1);
  EXPECT_FALSE(field->is_closed());
}

TEST(Field, MistakesAreOneLineWithTheirPlace) {
  const std::pair<const char*, const char*> kMistakes[] = {
      {"size [0 1 0]", "found a field without area"},
      {"size [1 -1 0]", "found a field without area"},
      {"field_resolution 0", "found cells that are not positive"},
      {"size [1000 1000 0] field_resolution 1e-3", "found more than 1e9 cells"},
      {"size [100 100 0] field_resolution 5e-3", "memory_limit"},
      {"diffusion -1", "found a negative number"},
      {"evaporation -1", "found a negative number"},
      {"edge \"soft\"", "found the edge \"soft\", expected \"closed\" or \"open\""},
      {"initial 1e101", "found a value that is too large"},
      {"diffusion 10", "found a diffusion that takes more than 1000 steps"},
      {"picture \"nowhere.png\"", "nowhere.png"},
      {"picture_range [0 1e200]", "found a value that is too large"},
  };
  for (const auto& [properties, message] : kMistakes) {
    const LoadOutcome outcome =
        TryToLoad("# a comment\nfield( " + std::string(properties) + " )\n");
    EXPECT_FALSE(outcome.loaded) << properties;
    EXPECT_NE(outcome.errors.find(message), std::string::npos) << outcome.errors;
    EXPECT_EQ(outcome.errors.rfind("t.world:2:", 0), 0u) << outcome.errors;
    EXPECT_EQ(std::ranges::count(outcome.errors, '\n'), 1) << outcome.errors;
  }
}

/// Three by two pixels, the brightest in the north-east.
const char kPicture[] = "P2\n3 2\n255\n0 51 255\n102 0 0\n";

void ExpectPicture(const ModelField& field) {
  const std::vector<double> expected = {18, 10, 10, 10, 14, 30};
  ASSERT_EQ(field.values().size(), expected.size());
  for (size_t i = 0; i < expected.size(); i++) EXPECT_NEAR(field.values()[i], expected[i], 1e-12);
}

const char kWithPicture[] =
    "field( name \"f\" size [3 2 0] field_resolution 1 picture \"PICTURE\" "
    "picture_range [10 30] )\n";

TEST(Field, TakesItsValuesFromTheBrightnessOfAPicture) {
  const std::string path = testing::TempDir() + "field_test.pgm";
  std::ofstream(path) << kPicture;
  std::string text = kWithPicture;
  text.replace(text.find("PICTURE"), 7, path);
  const auto world = LoadText(text);
  ExpectPicture(*Find<ModelField>(*world, "f"));
  const std::vector<recording::WorldFile> files = recording::FilesOf(world.get());
  EXPECT_TRUE(std::ranges::any_of(files, [](const auto& file) { return file.content == kPicture; }))
      << "logs contain the picture";

  RunOptions options = OptionsOf(1);
  World copy(options);
  std::remove(path.c_str());
  ASSERT_TRUE(copy.LoadCopy(*world)) << "copies do not read the file";
  ExpectPicture(*Find<ModelField>(copy, "f"));
}

TEST(Field, TakesItsValuesFromAPictureInMemory) {
  InitLibrary();
  RunOptions options = OptionsOf(1);
  options.pictures = std::make_shared<const std::map<std::string, std::string>>(
      std::map<std::string, std::string>{{"PICTURE", kPicture}});
  World world(options);
  std::istringstream content(kWithPicture);
  ASSERT_TRUE(world.Load(content, "t.world"));
  ExpectPicture(*Find<ModelField>(world, "f"));
}

TEST(Field, ACellHasTheMeanBrightnessOfItsPixels) {
  picture::Samples picture{4, 2, 3, {}};
  for (const int brightness : {0, 100, 200, 200, 100, 200, 50, 250})
    for (int color = 0; color < 3; color++)
      picture.values.push_back(static_cast<uint8_t>(brightness));
  FieldValues values;
  values.Resize(2, 1);
  EXPECT_DOUBLE_EQ(field::Brightness(picture, values, 0, 0), 100 / 255.0);
  EXPECT_DOUBLE_EQ(field::Brightness(picture, values, 1, 0), 175 / 255.0);
}

}  // namespace
}  // namespace Stg
