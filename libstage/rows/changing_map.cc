// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/changing_map.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "rows/shown.hh"
#include "world/engine.hh"

namespace Stg::rows {

namespace grid = internal::grid;

namespace {

constexpr double kMostCells = 16e6;  // that outlines may cross, well below the limit of worlds

/// The low bits of 8 bytes that are 0 or 1, the first byte's lowest.
uint64_t BitsOfBytes(const uint8_t* bytes) {
  if constexpr (std::endian::native != std::endian::little) {
    uint64_t bits = 0;
    for (int i = 0; i < 8; i++) bits |= uint64_t{bytes[i] != 0} << i;
    return bits;
  }
  constexpr uint64_t kLow = 0x7f7f7f7f7f7f7f7fu, kOnes = 0x0101010101010101u;
  uint64_t word;
  std::memcpy(&word, bytes, sizeof word);
  const uint64_t occupied = (((word & kLow) + kLow) | word) >> 7 & kOnes;
  return occupied * 0x0102040810204080u >> 56;
}

/// Tiles of a box that contains the cells of all these corners.
grid::CellBox TilesAround(std::span<const point_int_t> corners) {
  grid::CellBox box{corners[0].x, corners[0].y, corners[0].x, corners[0].y};
  for (const point_int_t& p : corners)
    box = {std::min(box.min_x, p.x), std::min(box.min_y, p.y), std::max(box.max_x, p.x),
           std::max(box.max_y, p.y)};
  const auto tile = [](int32_t cell, int32_t more) { return (cell >> RAY_TILE_SHIFT) + more; };
  // A margin, because corners of turned maps are rounded one by one.
  return {tile(box.min_x, -1), tile(box.min_y, -1), tile(box.max_x, 1), tile(box.max_y, 1)};
}

}  // namespace

// ---- making -------------------------------------------------------------------------------------

std::unique_ptr<ChangingMap> ChangingMap::Make(std::unique_ptr<World> prototype,
                                               const std::string& model, std::string* reason,
                                               std::span<const VariedNumber> varied) {
  StandingMap map{};
  *reason = RowBridge::FindMap(prototype.get(), model, &map);
  if (!reason->empty()) return nullptr;
  std::shared_ptr<Scene> scene = RowBridge::MakeOwnScene(std::move(prototype), reason, varied);
  if (!scene) return nullptr;
  std::unique_ptr<ChangingMap> made(new ChangingMap(std::move(scene), map));
  *reason = made->Start();
  return reason->empty() ? std::move(made) : nullptr;
}

ChangingMap::ChangingMap(std::shared_ptr<Scene> scene, const StandingMap& map)
    : scene_(std::move(scene)),
      shared_(scene_),
      map_(map),
      turn_(SinCos(map.frame.a)),
      turned_(!(turn_.sine == 0 && turn_.cosine == 1)),
      now_(map.columns, map.rows),
      next_(map.columns, map.rows) {}

/// Takes the picture of the prototype. Returns the reason if that is not possible.
std::string ChangingMap::Start() {
  const std::string name = Named(*map_.model);
  if (scene_->exact) return "a ray is of the exact model, for which a map cannot change";
  const Size size = map_.model->GetGeom().size;
  const double side = scene_->cells_per_metre * std::max(size.x / columns(), size.y / rows());
  if (!(2.0 * (columns() + 1) * (rows() + 1) * (side + 1) < kMostCells))
    return name + " has too many cells (a coarser resolution is possible)";
  if (!FindCorners()) return name + " is outside of the grid";
  next_ = FirstPicture();
  tracer_.Trace(next_);
  if (!IsTraced()) return name + " has other blocks than the outlines of its bitmap";
  MergeBodies();
  if (!FindShown()) return name + " covers too large an area (a coarser resolution is possible)";
  SplitWalls();
  Apply();
  return "";
}

/// Finds the places of all corners. See BlockGroup::Fit(). False if they exceed the grid.
bool ChangingMap::FindCorners() {
  constexpr double kMostCoordinate = grid::kMaxCell / 2;
  const Size size = map_.model->GetGeom().size;
  const double dx = columns(), dy = rows();
  for (int x = 0; x <= columns(); x++) x_.push_back((x - (0 + dx / 2.0)) * (size.x / dx));
  for (int row = 0; row <= rows(); row++) y_.push_back((-row - (-dy + dy / 2.0)) * (size.y / dy));
  std::vector<point_int_t> outermost;
  for (const int x : {0, columns()})
    for (const int row : {0, rows()}) {
      const point_t place = Place({x, row});
      const double far = std::max(std::fabs(place.x), std::fabs(place.y));
      if (!(far * scene_->cells_per_metre < kMostCoordinate)) return false;
      outermost.push_back(CellOf({x, row}));
    }
  board_ = before_ = grid::TileBoard(TilesAround(outermost));
  for (int x = 0; x <= columns() && !turned_; x++) {
    wall_x_.push_back(WallCornerOf({x, 0}).x);
    cell_x_.push_back(CellOf({x, 0}).x);
  }
  for (int row = 0; row <= rows() && !turned_; row++) {
    wall_y_.push_back(WallCornerOf({0, row}).y);
    cell_y_.push_back(CellOf({0, row}).y);
  }
  return true;
}

/// The picture with the outlines that the model's blocks have.
picture::Bitmap ChangingMap::FirstPicture() const {
  const Size size = map_.model->GetGeom().size;
  const auto pixel = [](double place, double of, int count) {
    const double at = std::floor((place / of + 0.5) * count + 0.5);
    return static_cast<size_t>(std::clamp(at, 0.0, static_cast<double>(count)));
  };
  const auto width = static_cast<size_t>(columns()), height = static_cast<size_t>(rows());
  std::vector<uint8_t> crosses((width + 1) * height);  // an outline is at the left of the cell
  for (const auto& block : map_.model->body().blocks()) {
    const std::vector<point_t>& points = block->points();
    for (size_t i = 0; i < points.size(); i++) {
      const point_t &a = points[i], &b = points[i + 1 < points.size() ? i + 1 : 0];
      const size_t x = pixel(a.x, size.x, columns());
      if (x != pixel(b.x, size.x, columns())) continue;
      const auto rows_of = std::minmax({pixel(-a.y, size.y, rows()), pixel(-b.y, size.y, rows())});
      for (size_t row = rows_of.first; row < rows_of.second; row++)
        crosses[row * (width + 1) + x] ^= 1;
    }
  }
  picture::Bitmap picture(columns(), rows());
  for (size_t row = 0; row < height; row++) {
    bool inside = false;
    for (size_t x = 0; x < width; x++) {
      inside ^= crosses[row * (width + 1) + x] != 0;
      if (inside) picture.MakeSolid(x, row);
    }
  }
  return picture;
}

/// True if the model's blocks are the outlines that have been traced.
bool ChangingMap::IsTraced() const {
  const auto& blocks = map_.model->body().blocks();
  if (blocks.size() != tracer_.ends().size()) return false;
  size_t corner = 0;
  for (size_t i = 0; i < blocks.size(); i++) {
    const std::vector<point_t>& points = blocks[i]->points();
    if (corner + points.size() != tracer_.ends()[i]) return false;
    for (const point_t& point : points) {
      const picture::Tracer::Corner at = tracer_.corners()[corner++];
      if (point.x != x_[static_cast<size_t>(at.x)] || point.y != y_[static_cast<size_t>(at.row)])
        return false;
    }
  }
  return true;
}

/// Makes one body of the grid of all outlines, still without cells. It is as old as the first.
void ChangingMap::MergeBodies() {
  grid::Grid& cells = scene_->grid;
  bool is_first = true;
  map_.model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& sets) {
    cells.Rasterize(id, sets, {});
    if (is_first)
      body_ = id;
    else
      cells.RemoveBody(id);
    is_first = false;
  });
  const CellBox& box = board_.box();
  cells.MakeRegions(box);
  for (int32_t y = box.min_y; y <= box.max_y; y++)
    for (int32_t x = box.min_x; x <= box.max_x; x++)
      slots_.push_back(cells.FindTileSlot({.x = x, .y = y}));
  changed_.reserve(slots_.size());
}

/// Finds the maps of cells in which the model shows, and makes them anew. False if one is too
/// large.
bool ChangingMap::FindShown() {
  const WorldEngine& engine = scene_->prototype->engine();
  const grid::Body map = scene_->grid.body(body_);
  bool fits = true;
  const auto add = [&](CellMap* cell_map, bool with_cells, auto shows) {
    std::vector<grid::CellSet> others;
    for (const Model* model : engine.models) {
      if (IsOfMover(*model) || model == map_.model) continue;
      model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& cells) {
        if (shows(*model, engine.scene.grid.body(id)))
          others.insert(others.end(), cells.begin(), cells.end());
      });
    }
    fits = AddShown(cell_map, with_cells, shows(*map_.model, map), others) && fits;
  };
  shown_.reserve(scene_->blocked.size() + scene_->seen.size());
  std::vector<uint8_t> has_blocked(scene_->blocked.size()), has_seen(scene_->seen.size());
  for (const Body& body : scene_->bodies)
    if (!std::exchange(has_blocked[body.blocked], 1))
      add(&scene_->blocked[body.blocked], true, [&](const Model& model, const grid::Body& other) {
        return Blocks(model, other, body.height);
      });
  for (const Sensor& sensor : scene_->sensors)
    if (!std::exchange(has_seen[sensor.seen], 1))
      add(&scene_->seen[sensor.seen], false,
          [&](const Model&, const grid::Body& other) { return IsSeenAt(other, sensor.z); });
  scene_->finders.ForEach([&](const Finder& finder) {
    if (!std::exchange(has_seen[finder.seen], 1))
      add(&scene_->seen[finder.seen], false, [&](const Model& model, const grid::Body& other) {
        return Stops(finder.fan, Bounds(other.z_min, other.z_max), model);
      });
  });
  return fits;
}

bool ChangingMap::AddShown(CellMap* map, bool with_cells, bool shows,
                           std::span<const grid::CellSet> others) {
  if (!shows) return true;
  if (!map->MakeChangeable(board_.box(), others, with_cells)) return false;
  Shown shown{map, {}, {}};
  const CellBox& box = board_.box();
  for (int32_t y = box.min_y; y <= box.max_y && with_cells; y++)
    for (int32_t x = box.min_x; x <= box.max_x; x++) shown.others.push_back(map->Tile(x, y));
  shown.seeds.assign(map->distances().begin(), map->distances().end());
  const CellMap::Content content = map->content();
  for (const Shown& known : shown_) {
    const CellMap::Content of = known.map->content();
    if (of.x == content.x && of.y == content.y && of.width == content.width &&
        known.seeds == shown.seeds)
      shown.equal = &known;
  }
  shown_.push_back(std::move(shown));
  return true;
}

/// Keeps the walls of others, before and after those of the map.
void ChangingMap::SplitWalls() {
  if (!scene_->outlines || !map_.model->vis.obstacle_return) return;
  const uint32_t id = map_.model->GetId();
  const auto place = [&](const motion::Walls& walls, auto f) {
    const auto& edges = walls.edges();
    const auto is_own = [&](const motion::WallEdge& edge) { return edge.group == id; };
    const auto first = std::ranges::find_if(edges, is_own);
    if (first == edges.end()) return false;
    const auto last = std::find_if_not(first, edges.end(), is_own);
    f(static_cast<size_t>(first - edges.begin()), static_cast<size_t>(last - edges.begin()));
    return true;
  };
  const auto split = [&](size_t first, size_t last) {
    walls_before_ = walls_->Part(0, first);
    walls_after_ = walls_->Part(last, walls_->edges().size());
  };
  place(scene_->walls, [&](size_t first, size_t last) {
    const std::vector<const Model*>& models = scene_->finders.wall_models;
    const auto& edges = scene_->walls.edges();
    const auto at = models.begin() + edges[first].outline;
    models_before_.assign(models.begin(), at);
    models_after_.assign(models.begin() + edges[last - 1].outline + 1, models.end());
  });
  walls_ = &scene_->walls;
  if (scene_->wall_parts.empty()) {
    place(*walls_, split);
    return;
  }
  for (WallPart& part : scene_->wall_parts) {
    walls_ = &part.walls;
    if (place(*walls_, split)) return;
  }
}

// ---- corners ------------------------------------------------------------------------------------

/// The global place of a corner, as bodies are drawn. See Placement::AppendCorners().
point_t ChangingMap::Place(picture::Tracer::Corner corner) const {
  const double x = x_[static_cast<size_t>(corner.x)], y = y_[static_cast<size_t>(corner.row)];
  return point_t(map_.frame.x + x * turn_.cosine - y * turn_.sine,
                 map_.frame.y + x * turn_.sine + y * turn_.cosine);
}

point_int_t ChangingMap::CellOf(picture::Tracer::Corner corner) const {
  const point_t place = Place(corner);
  return point_int_t(static_cast<int>(std::floor(place.x * scene_->cells_per_metre)),
                     static_cast<int>(std::floor(place.y * scene_->cells_per_metre)));
}

/// See ContactOutline::AddBody().
motion::Vector ChangingMap::WallCornerOf(picture::Tracer::Corner corner) const {
  const motion::Vector p{x_[static_cast<size_t>(corner.x)], y_[static_cast<size_t>(corner.row)]};
  return motion::Vector{map_.frame.x, map_.frame.y} + motion::Rotate(p, turn_.sine, turn_.cosine);
}

// ---- changes ------------------------------------------------------------------------------------

bool ChangingMap::Set(std::span<const uint8_t> cells) {
  ReadCells(cells);
  const size_t words = now_.words_per_row() * static_cast<size_t>(rows());
  if (std::equal(now_.Row(0), now_.Row(0) + words, next_.Row(0))) return false;
  tracer_.Trace(next_);
  Apply();
  return true;
}

/// Stores the cells as the next picture, whose first row is the highest.
void ChangingMap::ReadCells(std::span<const uint8_t> cells) {
  const auto width = static_cast<size_t>(columns()), height = static_cast<size_t>(rows());
  STAGE_ASSERT(cells.size() == width * height);
  for (size_t y = 0; y < height; y++) {
    const uint8_t* const from = cells.data() + y * width;
    uint64_t* const to = next_.Row(height - 1 - y);
    std::fill_n(to, next_.words_per_row(), 0);
    size_t x = 0;
    for (; x + 8 <= width; x += 8) to[x / 64] |= BitsOfBytes(from + x) << x % 64;
    for (; x < width; x++) to[x / 64] |= uint64_t{from[x] != 0} << x % 64;
  }
}

/// Brings the scene into the state for the next picture, which has been traced.
void ChangingMap::Apply() {
  std::swap(now_, next_);
  Draw();
  ChangeGrid();
  ChangeMaps();
  if (walls_) ChangeWalls();
  scene_->map_version++;
}

/// Draws the outlines on the board.
void ChangingMap::Draw() {
  std::swap(board_, before_);
  board_.Clear();
  const std::span<const picture::Tracer::Corner> corners = tracer_.corners();
  const auto cell_of = [&](picture::Tracer::Corner corner) {
    return turned_ ? CellOf(corner)
                   : point_int_t(cell_x_[static_cast<size_t>(corner.x)],
                                 cell_y_[static_cast<size_t>(corner.row)]);
  };
  size_t first = 0;
  for (const uint32_t end : tracer_.ends()) {
    point_int_t from = cell_of(corners[end - 1]);
    for (; first < end; first++) {
      const point_int_t to = cell_of(corners[first]);
      board_.DrawEdge(from, to);
      from = to;
    }
  }
}

void ChangingMap::ChangeGrid() {
  const std::span<const uint64_t> words = board_.words(), before = before_.words();
  changed_.clear();
  bool fills = false;
  for (size_t i = 0; i < words.size(); i++) {
    if (words[i] == before[i]) continue;
    scene_->grid.ChangeTile(body_, slots_[i], before[i], words[i]);
    fills = fills || (words[i] == 0) != (before[i] == 0);
    changed_.push_back(static_cast<uint32_t>(i));
  }
  fills_other_tiles_ = fills || fills_other_tiles_;
  if (fills) SetExtent();
}

/// The extent of a grid is that of the superregions in which something has been drawn.
void ChangingMap::SetExtent() {
  const CellBox& box = board_.box();
  const auto width = static_cast<int32_t>(board_.width());
  const uint64_t* row = board_.words().data();
  CellBox drawn{INT32_MAX, INT32_MAX, INT32_MIN, INT32_MIN};  // in tiles of the board
  for (int32_t y = 0; y <= box.max_y - box.min_y; y++, row += width) {
    int32_t first = 0, last = width - 1;
    while (first < width && row[first] == 0) first++;
    if (first == width) continue;
    while (row[last] == 0) last--;
    drawn = {std::min(drawn.min_x, first), std::min(drawn.min_y, y), std::max(drawn.max_x, last),
             y};
  }
  CellBox extent = map_.extent_of_others;
  if (!drawn.empty()) {
    constexpr int kShift = RAY_SUPER_SHIFT - RAY_TILE_SHIFT;
    const auto begin = [](int32_t tile) { return (tile >> kShift) << RAY_SUPER_SHIFT; };
    const auto end = [](int32_t tile) { return ((tile >> kShift) + 1) << RAY_SUPER_SHIFT; };
    const CellBox supers{begin(box.min_x + drawn.min_x), begin(box.min_y + drawn.min_y),
                         end(box.min_x + drawn.max_x) - 1, end(box.min_y + drawn.max_y) - 1};
    if (extent.empty()) extent = supers;
    extent = {std::min(extent.min_x, supers.min_x), std::min(extent.min_y, supers.min_y),
              std::max(extent.max_x, supers.max_x), std::max(extent.max_y, supers.max_y)};
  }
  scene_->grid.SetExtent(extent);
}

void ChangingMap::ChangeMaps() {
  const CellBox& box = board_.box();
  const auto width = static_cast<uint32_t>(board_.width());
  for (Shown& shown : shown_) {
    if (!shown.others.empty())
      for (const uint32_t i : changed_)
        shown.map->SetTile(box.min_x + static_cast<int32_t>(i % width),
                           box.min_y + static_cast<int32_t>(i / width),
                           shown.others[i] | board_.words()[i]);
    if (fills_other_tiles_) MeasureDistances(&shown);
  }
  fills_other_tiles_ = false;
}

void ChangingMap::MeasureDistances(Shown* shown) {
  const std::span<uint8_t> distances = shown->map->distances();
  if (shown->equal) {
    std::ranges::copy(shown->equal->map->distances(), distances.begin());
    return;
  }
  std::ranges::copy(shown->seeds, distances.begin());
  const CellMap::Content content = shown->map->content();
  const CellBox& box = board_.box();
  const uint64_t* word = board_.words().data();
  for (int32_t y = box.min_y; y <= box.max_y; y++) {
    uint8_t* distance =
        &distances[static_cast<size_t>(y - content.y) * static_cast<size_t>(content.width) +
                   static_cast<size_t>(box.min_x - content.x)];
    for (size_t i = 0; i < board_.width(); i++) distance[i] = word[i] != 0 ? 0 : distance[i];
    word += board_.width();
  }
  shown->map->MeasureDistances();
}

/// See ContactPhase::AddWalls().
void ChangingMap::ChangeWalls() {
  const std::span<const picture::Tracer::Corner> corners = tracer_.corners();
  const motion::Interval height{map_.height.min, map_.height.max};
  const double friction = map_.model->GetFriction();
  const uint32_t group = map_.model->GetId();
  walls_->Clear();
  walls_->Append(walls_before_);
  size_t first = 0;
  for (const uint32_t end : tracer_.ends()) {
    corners_.clear();
    for (; first < end; first++) {
      const picture::Tracer::Corner at = corners[first];
      corners_.push_back(turned_ ? WallCornerOf(at)
                                 : motion::Vector{wall_x_[static_cast<size_t>(at.x)],
                                                  wall_y_[static_cast<size_t>(at.row)]});
    }
    walls_->Add(corners_, true, height, friction, group);
  }
  walls_->Append(walls_after_);
  if (walls_ == &scene_->walls) walls_->Index();
  std::vector<const Model*>& models = scene_->finders.wall_models;
  models.assign(models_before_.begin(), models_before_.end());
  models.resize(models.size() + tracer_.ends().size(), map_.model);
  models.insert(models.end(), models_after_.begin(), models_after_.end());
}

}  // namespace Stg::rows
