// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/blobfinder.hh"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numeric>

#include "geometry/load_error.hh"
#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/host.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/types/detections.hh"
#include "models/warn_about.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kWatts = 2.0;
constexpr unsigned kMaxWidth = 100'000;
constexpr size_t kMaxColors = 1000;
/// Blob heights assume bodies of twice this height in metres, centred on the optical axis.
constexpr double kHalfHeight = 0.3;

/// Rays pass through the finder's own tree and models without blob_return.
bool StopsBlobfinder(Model* candidate, const Model* finder, const void*) {
  return candidate->vis.blob_return && !candidate->IsRelated(finder);
}

/// Compares colours without opacity. Comparisons with NaN count as equal.
bool LooksLike(const Color& a, const Color& b) {
  constexpr double kTolerance = 1e-5;
  return !(std::fabs(a.r - b.r) > kTolerance || std::fabs(a.g - b.g) > kTolerance ||
           std::fabs(a.b - b.b) > kTolerance);
}

void Describe(const ModelBlobfinder& blobfinder, SensorExtent* extent) {
  extent->rays = blobfinder.scan_width;
}

using Blob = ModelBlobfinder::Blob;
const std::vector<Blob>& Seen(const ModelBlobfinder& finder) { return finder.GetBlobs(); }

ReadingShape ShapeOfCount(const ModelBlobfinder&) { return ReadingShape(); }
bool CopyCount(const ModelBlobfinder& finder, size_t, int32_t* to) {
  *to = static_cast<int32_t>(Seen(finder).size());
  return true;
}

}  // namespace

ModelType BlobfinderType() {
  return ModelTypeOf<ModelBlobfinder>("blobfinder")
      .Moves(ModelType::kStays)
      .Updates(ModelType::kParallel | ModelType::kIgnoresOwnTree | ModelType::kUsesEverythingLayer)
      .Senses(Describe)
      .Measurable()
      .Reads(MakeReading("count", "", "Number of blobs that are seen.", ShapeOfCount, CopyCount))
      .Reads(MakeListReading("color", "",
                             "Red, green, blue and opacity, each 0 to 1, of each blob, from "
                             "right to left in the image.",
                             Seen, detections::PutColor, 4))
      .Reads(MakeListReading("box", "pixels",
                             "Left, top, right and bottom, from the top left corner.", Seen,
                             detections::PutBox, 4))
      .Reads(
          MakeListReading("range", "m", "Mean range of the blob.", Seen, detections::PutBlobRange));
}

ModelBlobfinder::ModelBlobfinder(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      fov(M_PI / 3.0),
      pan(0.0),
      range(12.0),
      scan_height(60),
      scan_width(80),
      rays_out_(false),
      table_fov_(0),
      table_width_(0),
      table_generation_(0),
      first_direction_(0) {
  ClearBlocks();
}

ModelBlobfinder::~ModelBlobfinder() { host().FinishRaysOf(this); }

void ModelBlobfinder::AddColor(Color col) { colors_.push_back(col); }
void ModelBlobfinder::RemoveColor(Color col) { std::erase(colors_, col); }
void ModelBlobfinder::RemoveAllColors() { colors_.clear(); }

void ModelBlobfinder::Load() {
  if (!LoadCommon()) return;
  wf->ReadTuple(wf_entity, "image", 0, 2, "uu", &scan_width, &scan_height);
  if (scan_width > kMaxWidth)
    wf->Fail(wf_entity, "image",
             "found a width of " + std::to_string(scan_width) +
                 " pixels, expected a number from 0 to " + std::to_string(kMaxWidth));
  host().memory.Take(*wf, wf_entity, "image", scan_width, MemoryBudget::kSample,
                     "columns of pixels");
  range = wf->ReadFloat(wf_entity, "range", range);
  if (range < 0) wf->Fail(wf_entity, "range", "found a negative range, expected 0 or more");
  fov = wf->ReadAngle(wf_entity, "fov", fov);
  pan = wf->ReadAngle(wf_entity, "pan", pan);
  LoadColors();
}

/// Reads the first `colors_count` elements of `colors`.
void ModelBlobfinder::LoadColors() {
  if (!wf->PropertyExists(wf_entity, "colors")) return;
  colors_.clear();
  wf->ReadString(wf_entity, "colors", "");  // marks the property as read, whatever the count
  const size_t length = wf->TupleLength(wf_entity, "colors");
  if (!wf->PropertyExists(wf_entity, "colors_count"))
    wf->Warn(wf_entity, "colors",
             "found no colors_count, expected the number of colors to use; reporting every color");
  const int count = wf->ReadInt(wf_entity, "colors_count", 0);
  if (count < 0 || static_cast<size_t>(count) > length)
    throw LoadError(wf->Where(wf_entity, "colors_count") + ": found a colors_count of " +
                        std::to_string(count) + ", expected 0 to " + std::to_string(length) +
                        ", the number of colors",
                    255);
  if (static_cast<size_t>(count) > kMaxColors)
    wf->Fail(wf_entity, "colors_count",
             "found " + std::to_string(count) + " colors, expected at most " +
                 std::to_string(kMaxColors));
  for (int i = 0; i < count; i++) {
    const std::string name = wf->ReadElement(wf_entity, "colors", static_cast<size_t>(i));
    Color wanted;
    if (!Color::Lookup(name, &wanted))
      wf->Warn(wf_entity, "colors",
               "found " + messages::Quoted(name) + ", expected the name of a color; using red");
    AddColor(wanted);
  }
}

void ModelBlobfinder::Startup() {
  watts = kWatts;
  Model::Startup();
}

void ModelBlobfinder::Shutdown() {
  watts = 0;
  blobs_.clear();
  rays_out_ = false;
  Model::Shutdown();
}

void ModelBlobfinder::Update() {
  if (subs == 0) return;
  GatherSerially();
  Model::Update();
}

void ModelBlobfinder::Gather(sensing::FanList* fans) {
  if (scan_width > kMaxWidth) {
    WarnAbout(*this, "found a width of %u pixels, expected a number from 0 to %u; using that many",
              scan_width, kMaxWidth);
    scan_width = kMaxWidth;
  }
  if (scan_width == 0)
    blobs_.clear();
  else
    AddFan(fans);
}

void ModelBlobfinder::AddFan(sensing::FanList* fans) {
  sensing::Scene& shared = scene();
  const double f = std::isfinite(fov) ? fov : 0.0;
  if (table_fov_ != f || table_width_ != scan_width ||
      table_generation_ != shared.tables.generation()) {
    table_fov_ = f;
    table_width_ = scan_width;
    table_generation_ = shared.tables.generation();
    first_direction_ = shared.tables.Find(f, scan_width);
  }
  sensing::Fan fan;
  fan.predicate = StopsBlobfinder;
  fan.finder = this;
  fan.sink = this;
  fan.z_test = false;
  fan.record.first_direction = first_direction_;
  PlaceFan(&fan, LocalToGlobal(Pose(0, 0, 0, pan)), range > 0 ? range : 0.0, RayModel::kDefault);
  fans->Add(fan, scan_width);
  rays_out_ = true;
}

void ModelBlobfinder::ReceiveHits(uint32_t, const sensing::RayHits& hits) {
  if (!rays_out_) return;
  rays_out_ = false;
  FindBlobs(hits, table_fov_, &blobs_);
}

/// Finds the blobs in the hits of rays over a field of view of `table_fov` radians.
void ModelBlobfinder::FindBlobs(const sensing::RayHits& hits, double table_fov,
                                std::vector<Blob>* blobs) const {
  blobs->clear();
  const sensing::HitInterval* hit_interval = hits.intervals;
  for (uint32_t i = 0; i < hits.count;) {
    STAGE_ASSERT(hit_interval->end > i && hit_interval->end <= hits.count);
    if (!hit_interval->model) {
      i = (hit_interval++)->end;
      continue;
    }
    const uint32_t first = i;
    const Color seen = hit_interval->model->GetShownColor();
    while (i < hits.count && hit_interval->model &&
           LooksLike(hit_interval->model->GetShownColor(), seen))
      i = (hit_interval++)->end;
    if (Reports(seen)) {
      const double sum = std::accumulate(hits.ranges + first, hits.ranges + i, 0.0);
      Blob blob = MakeBlob(seen, sum / (i - first), table_fov);
      blob.left = hits.count - i;  // rays are numbered from the right, pixels from the left
      blob.right = hits.count - first - 1;
      blobs->push_back(blob);
    }
    // The ray that ended the blob belongs to none.
    if (i < hits.count && ++i == hit_interval->end) hit_interval++;
  }
}

bool ModelBlobfinder::Reports(const Color& seen) const {
  return colors_.empty() || std::any_of(colors_.begin(), colors_.end(),
                                        [&](const Color& c) { return LooksLike(c, seen); });
}

ModelBlobfinder::Blob ModelBlobfinder::MakeBlob(const Color& seen, double mean_range,
                                                double table_fov) const {
  Blob blob;
  blob.color = seen;
  blob.range = mean_range;
  const double height = scan_height;
  const uint32_t middle = scan_height / 2;
  const double pixel = std::fabs(table_fov) / height;
  const double reach = std::trunc(ArcTangent(kHalfHeight, mean_range) / pixel);
  blob.top = static_cast<uint32_t>(std::max(0.0, middle - reach));
  blob.bottom = static_cast<uint32_t>(std::min(height, middle + reach));
  return blob;
}

void ModelBlobfinder::Blob::ExchangeState(StateExchange& exchange) {
  exchange(color, left, top, right, bottom, range);
}

void ModelBlobfinder::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  exchange(fov, pan, range, scan_height, scan_width, colors_, blobs_);
}

}  // namespace Stg
