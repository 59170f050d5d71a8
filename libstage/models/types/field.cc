// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/field.hh"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "geometry/load_error.hh"
#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "models/picture_path.hh"
#include "models/property_checks.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/field_evolution.hh"
#include "models/types/field_values.hh"
#include "pictures/picture.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {
constexpr double kUsualFieldCell = 0.05;  // metres
constexpr double kMaxFieldCells = 1e9;
constexpr usec_t kUsualLogInterval = 1'000'000;
constexpr double kLongestInterval = 1e12;  // milliseconds
}  // namespace

ModelType FieldType() {
  return ModelTypeOf<ModelField>("field").Moves(ModelType::kStays).Updates(ModelType::kParallel);
}

ModelField::ModelField(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      values_(std::make_unique<FieldValues>()),
      diffusion_(0),
      evaporation_(0),
      closed_(true),
      has_cells_(false),
      evolved_to_(0),
      log_interval_(kUsualLogInterval) {
  ClearBlocks();
  geom.size = Size(1, 1, 0);
  color = Color(0.1, 0.5, 0.2);
  vis.obstacle_return = false;
  vis.blob_return = false;
  vis.ranger_return = -1.0;
  values_->Resize(1, 1);
  InsertByAge(&host().fields, this);
}

ModelField::~ModelField() { std::erase(host().fields, this); }

// ---- loading ------------------------------------------------------------------------------------

void ModelField::Load() {
  const bool first = !has_cells_;
  if (!LoadCommon()) return;
  if (first) LoadCells();
  LoadEvolution();
  if (first) LoadValues();
  has_cells_ = true;
}

void ModelField::LoadCells() {
  const Size& size = geom.size;
  if (!(size.x > 0 && size.y > 0))
    wf->Fail(wf_entity, "size",
             "found a field without area, expected a width and a height above 0");
  const double cell = wf->ReadLength(wf_entity, "field_resolution", kUsualFieldCell);
  if (!(cell > 0))
    wf->Fail(wf_entity, "field_resolution",
             "found cells that are not positive, expected the length of a cell");
  // Sizes that are multiples of the cell give exactly that many cells in spite of rounding.
  const auto count = [&](double length) { return std::max(1.0, std::ceil(length / cell - 1e-6)); };
  const double columns = count(size.x), rows = count(size.y);
  if (!(columns * rows <= kMaxFieldCells))
    wf->Fail(wf_entity, "field_resolution",
             "found more than 1e9 cells in a field, expected larger cells");
  const auto cells = static_cast<size_t>(columns) * static_cast<size_t>(rows);
  host().memory.Take(*wf, wf_entity, "field_resolution", cells, MemoryBudget::kFieldCell,
                     "cells of a field");
  values_->Resize(static_cast<size_t>(columns), static_cast<size_t>(rows));
}

void ModelField::LoadEvolution() {
  diffusion_ = wf->ReadFloat(wf_entity, "diffusion", diffusion_);
  CheckNotNegative(*wf, wf_entity, "diffusion", diffusion_);
  evaporation_ = wf->ReadFloat(wf_entity, "evaporation", evaporation_);
  CheckNotNegative(*wf, wf_entity, "evaporation", evaporation_);
  const std::string edge = wf->ReadString(wf_entity, "edge", closed_ ? "closed" : "open");
  if (edge != "closed" && edge != "open")
    wf->Fail(wf_entity, "edge",
             "found the edge " + messages::Quoted(edge) + ", expected \"closed\" or \"open\"");
  closed_ = edge == "closed";
  const double log_interval =
      wf->ReadFloat(wf_entity, "log_interval", static_cast<double>(log_interval_) / 1000);
  CheckNotNegative(*wf, wf_entity, "log_interval", log_interval);
  log_interval_ = static_cast<usec_t>(std::min(log_interval, kLongestInterval) * 1000);
  const double step = static_cast<double>(std::max(interval, world_base().sim_interval)) / 1e6;
  if (field::CountSubsteps(*this, step) > field::kMaxSubsteps)
    wf->Fail(wf_entity, "diffusion",
             "found a diffusion that takes more than " + std::to_string(field::kMaxSubsteps) +
                 " steps of the field's scheme at once, expected less, larger cells or a shorter "
                 "update_interval");
}

/// Sets the values before the first step.
void ModelField::LoadValues() {
  const double initial = wf->ReadFloat(wf_entity, "initial", 0);
  if (!FieldValues::IsValid(initial))
    wf->Fail(wf_entity, "initial", "found a value that is too large, expected at most 1e100");
  const size_t cells = values_->all().size();
  if (initial != 0)
    for (size_t cell = 0; cell < cells; cell++) values_->Set(cell, initial);

  double low = 0, high = 1;
  wf->ReadTuple(wf_entity, "picture_range", 0, 2, "ff", &low, &high);
  if (!FieldValues::IsValid(low) || !FieldValues::IsValid(high))
    wf->Fail(wf_entity, "picture_range", "found a value that is too large, expected at most 1e100");
  const std::string name = wf->ReadString(wf_entity, "picture", "");
  if (name.empty()) return;
  const picture::Samples& picture = SamplesOfPicture(&host(), wf, wf_entity, "picture", name);
  for (size_t row = 0; row < rows(); row++)
    for (size_t column = 0; column < columns(); column++)
      values_->Set(row * columns() + column,
                   low + (high - low) * field::Brightness(picture, *values_, column, row));
}

// ---- values -------------------------------------------------------------------------------------

size_t ModelField::columns() const { return values_->columns(); }
size_t ModelField::rows() const { return values_->rows(); }
const std::vector<double>& ModelField::values() const { return values_->all(); }

double ModelField::Integral() const {
  double sum = 0;
  for (const double value : values()) sum += value;
  return sum * CellWidth() * CellHeight();
}

/// Converts a global place to columns and rows from the south-western corner. Returns false
/// outside.
bool ModelField::ToCells(double x, double y, double* column, double* row) const {
  const Pose frame = GetGlobalPose() + geom.pose;
  const SineCosine turn = SinCos(frame.a);
  const double dx = x - frame.x, dy = y - frame.y;
  const double east = dx * turn.cosine + dy * turn.sine + geom.size.x / 2;
  const double north = dy * turn.cosine - dx * turn.sine + geom.size.y / 2;
  if (!(east >= 0 && east <= geom.size.x && north >= 0 && north <= geom.size.y)) return false;
  *column = east / CellWidth();
  *row = north / CellHeight();
  return std::isfinite(*column) && std::isfinite(*row);  // the size may have become 0
}

bool ModelField::FindCell(double x, double y, size_t* cell) const {
  double column = 0, row = 0;
  if (!ToCells(x, y, &column, &row)) return false;
  *cell = std::min(static_cast<size_t>(row), rows() - 1) * columns() +
          std::min(static_cast<size_t>(column), columns() - 1);
  return true;
}

double ModelField::NearestValue(double x, double y) const {
  size_t cell = 0;
  return FindCell(x, y, &cell) ? values()[cell] : 0;
}

double ModelField::LinearValue(double x, double y) const {
  double column = 0, row = 0;
  if (!ToCells(x, y, &column, &row)) return 0;
  const auto split = [](double place, size_t count, size_t* lower) {
    const double from_middle = std::clamp(place - 0.5, 0.0, static_cast<double>(count - 1));
    *lower = static_cast<size_t>(from_middle);
    return from_middle - static_cast<double>(*lower);
  };
  size_t west = 0, south = 0;
  const double right = split(column, columns(), &west), up = split(row, rows(), &south);
  const size_t east = std::min(west + 1, columns() - 1), north = std::min(south + 1, rows() - 1);
  const auto between = [](double a, double b, double share) { return a * (1 - share) + b * share; };
  return between(between(values_->At(west, south), values_->At(east, south), right),
                 between(values_->At(west, north), values_->At(east, north), right), up);
}

bool ModelField::Deposit(double x, double y, double amount) {
  size_t cell = 0;
  if (!std::isfinite(amount) || !FindCell(x, y, &cell)) return false;
  const double value = amount / (CellWidth() * CellHeight());
  values_->Add(cell, std::clamp(value, -2 * kLargest, 2 * kLargest));
  return true;
}

bool ModelField::SetValue(double x, double y, double value) {
  size_t cell = 0;
  if (!FieldValues::IsValid(value) || !FindCell(x, y, &cell)) return false;
  values_->Set(cell, value);
  return true;
}

bool ModelField::SetValues(const double* from, size_t count) {
  if (count != values().size() || !std::all_of(from, from + count, FieldValues::IsValid))
    return false;
  for (size_t cell = 0; cell < count; cell++) values_->Set(cell, from[cell]);
  return true;
}

namespace {
bool IsRate(double number) { return number >= 0 && std::isfinite(number); }
}  // namespace

bool ModelField::SetDiffusion(double square_metres_per_second) {
  if (!IsRate(square_metres_per_second)) return false;
  diffusion_ = square_metres_per_second;
  return true;
}

bool ModelField::SetEvaporation(double per_second) {
  if (!IsRate(per_second)) return false;
  evaporation_ = per_second;
  return true;
}

void ModelField::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(diffusion_, evaporation_, closed_, evolved_to_, *values_);
  if (exchange.restoring() && !(IsRate(diffusion_) && IsRate(evaporation_)))
    exchange.Fail("found a field with an invalid diffusion or evaporation");
}

}  // namespace Stg
