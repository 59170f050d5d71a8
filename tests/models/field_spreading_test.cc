// SPDX-License-Identifier: GPL-2.0-or-later
//
// Diffusion and evaporation of fields, compared with closed forms.

#include <cmath>

#include "geometry/exponential.hh"
#include "models/types/field_values.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

TEST(FieldSpreading, ExponentialHasTheErrorThatItsHeaderStates) {
  for (double x = -740; x < 700; x += 0.37)
    EXPECT_NEAR(Exponential(x) / std::exp(x), 1, x < -708 ? 1e-2 : 1e-15) << x;
  EXPECT_EQ(Exponential(0), 1);
  EXPECT_EQ(Exponential(-1e300), 0);
  EXPECT_EQ(Exponential(-INFINITY), 0);
  EXPECT_EQ(Exponential(1e300), INFINITY);
  EXPECT_TRUE(std::isnan(Exponential(NAN)));
}

std::string Numbers(double a, double b) {
  return "[" + std::to_string(a) + " " + std::to_string(b) + " 0]";
}

constexpr double kDiffusion = 0.0125, kMass = 3, kDecay = 0.2, kSeconds = 4.8;

/// Largest error, relative to the peak, of a point source after 4.8 s: the closed form is
/// M / (4 pi D t) exp(-r^2 / (4 D t) - evaporation t). The step is proportional to the square of
/// the cell.
double ErrorOfPointSource(double cell, double width, double height) {
  const int step = static_cast<int>(std::lround(16000 * cell * cell));  // ms
  const std::string interval = std::to_string(step);
  const auto world =
      LoadText("interval_sim " + interval + "\nfield( name \"f\" size " + Numbers(width, height) +
               " field_resolution " + std::to_string(cell) + " diffusion 0.0125 evaporation 0.2" +
               " update_interval " + interval + " )\n");
  auto* const field = Find<ModelField>(*world, "f");
  field->Deposit(0, 0, kMass);  // the number of cells is odd, so that one is in the middle
  EXPECT_DOUBLE_EQ(field->Integral(), kMass);
  Step(*world, 4800 / step);
  const double spread = 4 * kDiffusion * kSeconds;
  const double peak = kMass / (M_PI * spread) * std::exp(-kDecay * kSeconds);
  double error = 0;
  for (size_t row = 0; row < field->rows(); row++)
    for (size_t column = 0; column < field->columns(); column++) {
      const double x = (static_cast<double>(column) + 0.5) * field->CellWidth() - width / 2;
      const double y = (static_cast<double>(row) + 0.5) * field->CellHeight() - height / 2;
      const double found = field->values()[row * field->columns() + column];
      error = std::max(error, std::fabs(found - peak * std::exp(-(x * x + y * y) / spread)));
    }
  return error / peak;
}

TEST(FieldSpreading, APointSourceConvergesToTheGaussian) {
  const double coarse = ErrorOfPointSource(0.1, 4.1, 4.1);
  const double middle = ErrorOfPointSource(0.05, 4.05, 4.05);
  const double fine = ErrorOfPointSource(0.025, 4.025, 4.025);
  EXPECT_LT(coarse, 0.03);
  EXPECT_NEAR(coarse / middle, 4, 0.5) << "of second order";
  EXPECT_NEAR(middle / fine, 4, 0.5);
}

TEST(FieldSpreading, CellsMayBeLongerThanWide) {
  // 41 columns of 0.1 m, and 31 rows of 0.0984 m.
  EXPECT_LT(ErrorOfPointSource(0.1, 4.1, 3.05), 0.03);
}

TEST(FieldSpreading, AClosedEdgeKeepsTheMass) {
  const auto world = LoadText(
      "field( name \"f\" size [0.5 0.35 0] field_resolution 0.05 diffusion 0.02 )\n"
      "field( name \"line\" size [0.05 1 0] diffusion 0.02 )\n"
      "field( name \"cell\" size [0.05 0.05 0] diffusion 0.02 )\n");
  for (const char* name : {"f", "line", "cell"}) {
    auto* const field = Find<ModelField>(*world, name);
    ASSERT_TRUE(field->Deposit(-field->GetGeom().size.x / 2, -field->GetGeom().size.y / 2, 2));
  }
  Step(*world, 600);
  for (const char* name : {"f", "line", "cell"}) {
    const auto* const field = Find<ModelField>(*world, name);
    EXPECT_NEAR(field->Integral(), 2, 1e-12) << name;
    const double even = 2 / (field->GetGeom().size.x * field->GetGeom().size.y);
    for (const double value : field->values()) EXPECT_NEAR(value, even, 1e-3 * even) << name;
  }
}

TEST(FieldSpreading, AnOpenEdgeLosesMass) {
  const auto world =
      LoadText("field( name \"f\" size [0.5 0.5 0] diffusion 0.02 initial 4 edge \"open\" )\n");
  const auto* const field = Find<ModelField>(*world, "f");
  double before = field->Integral();
  for (int i = 0; i < 20; i++) {
    Step(*world);
    EXPECT_LT(field->Integral(), before * 0.999);
    before = field->Integral();
  }
  // The slowest mode between edges where the value is 0, half a cell beyond the outermost middles:
  // it decays with diffusion * 2 * (pi / length)^2.
  Step(*world, 60);
  before = field->Integral();
  Step(*world, 10);
  const double length = 0.55, rate = 0.02 * 2 * std::pow(M_PI / length, 2);
  EXPECT_NEAR(field->Integral() / before, std::exp(-rate), 0.02 * std::exp(-rate));
}

TEST(FieldSpreading, EvaporationIsExponential) {
  const auto world = LoadText(
      "field( name \"f\" evaporation 0.3 initial 8 )\n"
      "field( name \"slow\" evaporation 0.3 initial 8 update_interval 700 )\n");
  Step(*world, 70);
  const double expected = 8 * std::exp(-0.3 * 7);
  for (const char* name : {"f", "slow"})
    for (const double value : Find<ModelField>(*world, name)->values())
      ASSERT_NEAR(value, expected, 1e-12) << name;
}

TEST(FieldSpreading, UpdatesAtMultiplesOfItsInterval) {
  const auto world = LoadText(
      "interval_sim 100\nfield( name \"f\" evaporation 1 initial 1 update_interval 250 )\n"
      "field( name \"each\" evaporation 1 initial 1 update_interval 0 )\n");
  const auto* const field = Find<ModelField>(*world, "f");
  std::vector<double> times;
  for (int i = 0; i < 8; i++) {
    Step(*world);
    times.push_back(-std::log(field->values()[0]));
  }
  const std::vector<double> expected = {0, 0, 0.25, 0.25, 0.5, 0.5, 0.5, 0.75};
  for (size_t i = 0; i < times.size(); i++) EXPECT_NEAR(times[i], expected[i], 1e-12) << i;
  EXPECT_NEAR(Find<ModelField>(*world, "each")->values()[0], std::exp(-0.8), 1e-12);
}

TEST(FieldSpreading, ManySubstepsAreStable) {
  const auto world = LoadText(
      "field( name \"f\" size [1 1 0] field_resolution 0.1 diffusion 5 )\n");  // 250 substeps
  auto* const field = Find<ModelField>(*world, "f");
  field->Deposit(0.05, 0.05, 1);
  Step(*world);
  EXPECT_NEAR(field->Integral(), 1, 1e-12);
  for (const double value : field->values()) EXPECT_NEAR(value, 1, 0.015);
  ASSERT_TRUE(field->SetDiffusion(1e300)) << "as much as 1000 substeps can do";
  field->Deposit(0.05, 0.05, 1);
  Step(*world);
  EXPECT_NEAR(field->Integral(), 2, 1e-12);
}

TEST(FieldSpreading, TracesBecomeZero) {
  const auto world = LoadText("field( name \"f\" evaporation 100 initial -3 )\n");
  Step(*world, 12);
  for (const double value : Find<ModelField>(*world, "f")->values()) {
    EXPECT_EQ(value, 0);
    EXPECT_FALSE(std::signbit(value));
  }
}

/// Cells evolve in one array and then another; rows of zeros are skipped in both.
TEST(FieldSpreading, SkippedRowsEqualComputedOnes) {
  const auto plain = [](std::vector<double> values, size_t columns, size_t rows, double share) {
    const std::vector<double> old = values;
    for (size_t row = 0; row < rows; row++)
      for (size_t i = 0; i < columns; i++) {
        const auto at = [&](size_t r, size_t c) { return old[r * columns + c]; };
        const double middle = at(row, i);
        const double across =
            share *
            ((at(row, i > 0 ? i - 1 : i) + at(row, i + 1 < columns ? i + 1 : i)) - 2 * middle);
        const double along =
            share *
            ((at(row > 0 ? row - 1 : row, i) + at(row + 1 < rows ? row + 1 : row, i)) - 2 * middle);
        const double value = 0.3 * (middle + (across + along));
        values[row * columns + i] = std::fabs(value) < ModelField::kSmallest ? 0 : value;
      }
    return values;
  };
  constexpr size_t kColumns = 43;  // several vectors and a rest
  FieldValues values;
  values.Resize(kColumns, 40);
  FieldValues::Substep substep;
  substep.x = substep.y = 0.25;
  substep.kept = 0.3;
  std::vector<double> expected(kColumns * 40);
  for (int i = 0; i < 300; i++) {
    if (i % 90 == 10) {
      const size_t cell = static_cast<size_t>(i) * 31 % expected.size();
      values.Set(cell, i);
      expected[cell] = i;
    }
    values.Begin(substep);
    values.EvolveRows(20, 40);
    values.EvolveRows(0, 20);
    values.End();
    expected = plain(expected, kColumns, 40, 0.25);
    ASSERT_EQ(values.all(), expected) << i;
    if (i == 99) {
      EXPECT_FALSE(values.AnyLive()) << "all have become 0";
    }
  }
}

}  // namespace
}  // namespace Stg
