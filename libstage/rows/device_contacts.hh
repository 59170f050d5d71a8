// SPDX-License-Identifier: GPL-2.0-or-later
//
// Contacts of outlines for devices: records of what moves and of walls, and the memory that a world
// needs for its pairs; part of device_image.hh.

#ifndef STAGE_ROWS_DEVICE_CONTACTS_HH
#define STAGE_ROWS_DEVICE_CONTACTS_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kernels/row_records.h"
#include "rows/scene.hh"

namespace Stg::rows {

/// Bytes for the pairs of a world, at most. Worlds with more pairs at a time take turns in memory
/// that is large enough for any of them.
inline constexpr size_t kContactBytes = size_t{128} << 10;

/// Says why contacts take too much memory, in words that follow "because"; empty if they do not.
std::string WhyNotContacts(const Scene& scene);

/// The records of a scene. Without contacts of outlines, all of them are empty.
class DeviceContacts {
 public:
  DeviceContacts(const Scene& scene, size_t contact_bytes);

  const std::vector<row_toucher_t>& touchers() const { return touchers_; }
  const std::vector<row_piece_t>& pieces() const { return pieces_; }
  const std::vector<row_edge_t>& edges() const { return edges_; }
  std::span<const motion::Vector> corners() const { return scene_.shapes.corners; }
  std::span<const uint32_t> edge_starts() const { return scene_.walls.index().starts; }
  std::span<const uint32_t> edge_entries() const { return scene_.walls.index().entries; }
  /// Sets what the header knows about contacts, except for offsets of the image.
  void Fill(row_scene_t* header) const;

 private:
  /// Numbers of elements of a room.
  struct Counts {
    uint64_t near, walls, pairs;
  };
  friend std::string WhyNotContacts(const Scene& scene);
  void AddToucher(const Mover& mover, uint32_t number);
  uint64_t MostWallsNear(double distance) const;
  uint32_t MostPieces() const;
  uint32_t UsualPieces() const;
  static Counts CountsOf(uint64_t near, uint64_t walls, uint64_t pieces);
  Counts Most() const;
  Counts Usual() const;
  row_room_t RoomFor(const Counts& counts) const;
  row_room_t RoomWithin(size_t bytes) const;

  const Scene& scene_;
  const size_t contact_bytes_;
  std::vector<row_toucher_t> touchers_;
  std::vector<row_piece_t> pieces_;
  std::vector<row_edge_t> edges_;
  uint32_t most_corners_ = 1, most_moved_ = 2;
};

}  // namespace Stg::rows

#endif
