// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/device_contacts.hh"

#include <algorithm>

#include "kernels/row_solve.h"

namespace Stg::rows {

namespace {

constexpr uint64_t kSharedBytes = uint64_t{256} << 20;
// Robots are rarely faster, and rarely have more others around.
constexpr double kUsualSpeed = 1.5;  // m/s
constexpr uint64_t kUsualNeighbours = 8;

row_point_t PointOf(motion::Vector v) { return {v.x, v.y}; }

}  // namespace

static_assert(sizeof(motion::Vector) == sizeof(row_point_t));

DeviceContacts::DeviceContacts(const Scene& scene, size_t contact_bytes)
    : scene_(scene), contact_bytes_(contact_bytes) {
  if (!scene.outlines) return;
  touchers_.resize(scene.columns.size());
  for (uint32_t k = 0; k < scene.movers.size(); k++)
    if (scene.movers[k].row != Mover::kNoRow) AddToucher(scene.movers[k], k);
  for (const motion::Piece& piece : scene.shapes.pieces) {
    pieces_.push_back(
        {piece.corner_count, {}, piece.radius, piece.core, piece.height.bottom, piece.height.top});
    most_moved_ =
        std::min(ROW_MOST_MOVED_CORNERS, std::max(most_moved_, uint32_t{piece.corner_count}));
  }
  for (const motion::WallEdge& edge : scene.walls.edges())
    edges_.push_back({{PointOf(edge.ends[0]), PointOf(edge.ends[1])},
                      {PointOf(edge.beyond[0]), PointOf(edge.beyond[1])},
                      edge.height.bottom,
                      edge.height.top,
                      edge.friction,
                      0});
}

void DeviceContacts::AddToucher(const Mover& mover, uint32_t number) {
  const motion::Columns& columns = scene_.columns;
  const uint32_t row = mover.row;
  const motion::Shape& shape = scene_.shapes.shapes[columns.shape[row]];
  const auto flag = [](bool is_set, uint32_t bit) { return is_set ? bit : 0; };
  row_toucher_t record{};
  record.mover = number;
  record.flags = flag(mover.robot != nullptr, ROW_IS_ROBOT) | flag(mover.is_pushed, ROW_IS_PUSHED) |
                 flag(columns.pushable[row] != 0, ROW_IS_PUSHABLE) |
                 flag(mover.bottom + mover.z < 0, ROW_IS_IN_FLOOR);
  record.first_piece = shape.first_piece;
  record.pieces = shape.piece_count;
  record.first_corner =
      shape.piece_count > 0 ? scene_.shapes.pieces[shape.first_piece].first_corner : 0;
  record.corners = shape.corner_count;
  record.core = shape.core;
  record.bound = shape.bound;
  record.grip = columns.grip[row];
  record.arm = columns.arm[row];
  record.friction = columns.friction[row];
  record.elevation = mover.z;
  most_corners_ = std::max(most_corners_, record.corners);
  touchers_[row] = record;
}

/// An upper bound of the number of edges that are in a square around a place.
uint64_t DeviceContacts::MostWallsNear(double distance) const {
  const motion::Walls::IndexContent index = scene_.walls.index();
  if (edges_.empty()) return 0;
  const auto width = static_cast<size_t>(index.columns), height = static_cast<size_t>(index.rows);
  const auto side = static_cast<size_t>(std::min(2 * distance / index.cell, 1e6)) + 2;
  // Numbers of entries of all cells before a row and a column.
  std::vector<uint64_t> sums((width + 1) * (height + 1), 0);
  const auto sum = [&](size_t x, size_t y) -> uint64_t& { return sums[y * (width + 1) + x]; };
  uint64_t most = 0;
  for (size_t y = 1; y <= height; y++)
    for (size_t x = 1; x <= width; x++) {
      const size_t cell = (y - 1) * width + x - 1;
      sum(x, y) = index.starts[cell + 1] - index.starts[cell] + sum(x - 1, y) + sum(x, y - 1) -
                  sum(x - 1, y - 1);
      const size_t x0 = x - std::min(x, side), y0 = y - std::min(y, side);
      most = std::max(most, sum(x, y) - sum(x0, y) - sum(x, y0) + sum(x0, y0));
    }
  return std::min<uint64_t>(most, edges_.size());
}

uint32_t DeviceContacts::MostPieces() const {
  uint32_t most = 1;
  for (const row_toucher_t& toucher : touchers_) most = std::max(most, toucher.pieces);
  return most;
}

/// Number of pieces of a toucher, on average and rounded up.
uint32_t DeviceContacts::UsualPieces() const {
  const auto count = static_cast<uint32_t>(touchers_.size());
  uint32_t sum = 0;
  for (const row_toucher_t& toucher : touchers_) sum += toucher.pieces;
  return count > 0 ? (sum + count - 1) / count : 0;
}

/// Numbers of pairs of touchers, of touchers with walls, and of their pieces.
DeviceContacts::Counts DeviceContacts::CountsOf(uint64_t near, uint64_t walls, uint64_t pieces) {
  return {near, walls, near * pieces * pieces + walls * pieces};
}

/// Numbers that no world can exceed.
DeviceContacts::Counts DeviceContacts::Most() const {
  const uint64_t count = touchers_.size();
  const uint64_t near = count > 0 ? count * (count - 1) / 2 : 0, walls = count * edges_.size();
  return CountsOf(near, walls, MostPieces());
}

/// Numbers that worlds rarely exceed.
DeviceContacts::Counts DeviceContacts::Usual() const {
  const uint64_t count = touchers_.size();
  const double reach = 2 * kUsualSpeed * static_cast<double>(scene_.step) / 1e6;
  const uint64_t near = std::min(Most().near, count * kUsualNeighbours);
  uint64_t walls = 0;
  double bound = -1;
  uint64_t around = 0;
  for (const row_toucher_t& toucher : touchers_) {
    if (toucher.bound != bound) around = MostWallsNear(toucher.bound + reach + ROW_TOUCH);
    bound = toucher.bound;
    walls += around;
  }
  return CountsOf(near, walls, UsualPieces());
}

row_room_t DeviceContacts::RoomFor(const Counts& counts) const {
  row_room_t room{};
  const auto place = [&](uint64_t count, size_t size) {
    const uint64_t at = room.bytes;
    room.bytes += (count * size + ROW_ALIGNMENT - 1) / ROW_ALIGNMENT * ROW_ALIGNMENT;
    return at;
  };
  const uint64_t solids = touchers_.size() + counts.near;
  room.near = place(counts.near, sizeof(row_near_t));
  room.walls = place(counts.walls, sizeof(uint32_t));
  room.solids = place(solids, sizeof(row_solid_t));
  room.corners = place(solids * most_corners_, sizeof(row_point_t));
  room.moved = place(touchers_.size() * 2 * most_moved_, sizeof(row_point_t));
  // One pair more, because a pair is tested where it would be kept.
  room.pairs = place(counts.pairs + 1, sizeof(row_pair_t));
  room.touches = place(counts.pairs, sizeof(row_touch_t));
  room.most_near = static_cast<uint32_t>(counts.near);
  room.most_walls = static_cast<uint32_t>(counts.walls);
  room.most_pairs = static_cast<uint32_t>(counts.pairs);
  return room;
}

/// A room for what is usual, or for as much of it as the bytes suffice for: rather for fewer walls
/// than for fewer pairs of movers, because not all movers are at walls at a time.
row_room_t DeviceContacts::RoomWithin(size_t bytes) const {
  Counts counts = Usual();
  for (;;) {
    const row_room_t room = RoomFor(counts);
    if (room.bytes <= bytes || counts.near + counts.walls == 0) return room;
    uint64_t& fewer = counts.walls > 0 ? counts.walls : counts.near;
    fewer = fewer * 3 / 4;
    counts = CountsOf(counts.near, counts.walls, UsualPieces());
  }
}

void DeviceContacts::Fill(row_scene_t* header) const {
  header->outlines = scene_.outlines;
  if (!scene_.outlines) return;
  const motion::Walls::IndexContent index = scene_.walls.index();
  header->edges = {index.bounds.x0,
                   index.bounds.y0,
                   index.bounds.x1,
                   index.bounds.y1,
                   index.cell,
                   static_cast<int>(index.columns),
                   static_cast<int>(index.rows),
                   static_cast<uint32_t>(edges_.size()),
                   {}};
  header->touchers = static_cast<uint32_t>(touchers_.size());
  header->most_corners = most_corners_;
  header->most_moved = most_moved_;
  header->rooms[0] = RoomWithin(contact_bytes_);
  header->rooms[1] = RoomFor(Most());
}

std::string WhyNotContacts(const Scene& scene) {
  const DeviceContacts contacts(scene, kContactBytes);
  const DeviceContacts::Counts most = contacts.Most();
  const uint64_t bytes = most.pairs > UINT32_MAX ? UINT64_MAX : contacts.RoomFor(most).bytes;
  if (bytes <= kSharedBytes) return "";
  return "contacts of its " + std::to_string(contacts.touchers().size()) +
         " movers with the outlines of each other and of " +
         std::to_string(contacts.edges().size()) + " edges of walls may take more than " +
         std::to_string(kSharedBytes >> 20) + " MB (contacts \"cells\" are possible)";
}

}  // namespace Stg::rows
