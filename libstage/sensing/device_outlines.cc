// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/device_outlines.hh"

#include <algorithm>
#include <bit>

#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {

constexpr std::size_t kGrainOfChanges = 64;

std::size_t WithReserve(std::size_t count) { return count + count / 4 + 8; }

}  // namespace

void DeviceOutlines::Allocate(const grid::Grid& grid) {
  if (grid.region_count() > regions_ || grid.body_count() > bodies_ ||
      grid.outline_count() > outlines_) {
    regions_ = WithReserve(grid.region_count());
    bodies_ = WithReserve(grid.body_count());
    outlines_ = WithReserve(grid.outline_count());
    Invalidate();  // all offsets change
  }
}

/// Calls put(place, value) for the words of a body.
template <typename Put>
void DeviceOutlines::PutBody(const grid::Grid& grid, grid::BodyId id, Put put) const {
  const grid::Body& body = grid.body(id);
  if (!body.exact()) return;  // no outline refers to it
  std::size_t place = first_body() + id * RAY_BODY_WORDS;
  const auto add = [&](double number) { put(place++, std::bit_cast<uint64_t>(number)); };
  add(body.x);
  add(body.y);
  add(body.radius);
  put(place++, reinterpret_cast<uintptr_t>(body.tree));
  put(place++, body.layers);
  STAGE_ASSERT(body.edges <= RAY_BODY_EDGES);
  for (uint32_t i = 0; i <= body.edges; i++) {
    add(body.corners[i].x);
    add(body.corners[i].y);
  }
}

/// Calls put(place, value) for the outlines of a tile.
template <typename Put>
void DeviceOutlines::PutOutlines(const grid::Grid& grid, uint32_t slot, Put put) const {
  for (grid::OutlineList number = grid.OutlinesIn(slot); number != 0;) {
    const grid::OutlineFragment& outline = grid.outline(number);
    const std::size_t place = first_outline() + number * RAY_OUTLINE_WORDS;
    put(place, outline.id | uint64_t{outline.edges} << 32);
    put(place + 1, outline.next);
    number = outline.next;
  }
}

uint64_t DeviceOutlines::FirstOutlines(const grid::Grid& grid, std::size_t pair) {
  const auto slot = static_cast<uint32_t>(2 * pair);
  return grid.OutlinesIn(slot) | uint64_t{grid.OutlinesIn(slot + 1)} << 32;
}

void DeviceOutlines::WriteAll(const grid::Grid& grid, uint64_t* words,
                              threads::WorkerPool* workers) {
  const auto put = [&](std::size_t place, uint64_t value) {
    STAGE_ASSERT(place < this->words());
    words[place] = value;
  };
  const std::size_t pairs = grid.region_count() * kPairs, bodies = grid.body_count();
  workers->Run(pairs, 4096, [&](std::size_t begin, std::size_t end, unsigned) {
    for (std::size_t pair = begin; pair < end; pair++) {
      put(pair, FirstOutlines(grid, pair));
      for (const std::size_t slot : {2 * pair, 2 * pair + 1})
        PutOutlines(grid, static_cast<uint32_t>(slot), put);
    }
  });
  std::fill(words + pairs, words + first_body(), 0);
  for (std::size_t id = 0; id < bodies; id++) PutBody(grid, static_cast<grid::BodyId>(id), put);
  version_ = grid.OutlinesVersion();
  is_valid_ = true;
  grid.ForgetChangedOutlines();
}

/// Lists what has changed, in the order of the words.
void DeviceOutlines::ListChanged(const grid::Grid& grid) {
  constexpr uint64_t kEvenTiles = 0x5555555555555555u;
  changed_.clear();
  grid.changed_outlines().ForEachRegion([&](std::size_t region, uint64_t tiles) {
    grid::ForEachBit((tiles | tiles >> 1) & kEvenTiles, [&](uint32_t tile) {
      changed_.push_back({region * kPairs + tile / 2, static_cast<uint32_t>(tiles >> tile & 3)});
    });
  });
  changed_pairs_ = changed_.size();
  const std::vector<uint8_t>& bodies = grid.changed_exact_bodies();
  for (std::size_t id = 0; id < bodies.size(); id++)
    if (bodies[id] != 0) changed_.push_back({id, 0});
}

std::size_t DeviceOutlines::FindChanges(const grid::Grid& grid, threads::WorkerPool* workers) {
  ListChanged(grid);
  found_.resize(std::max<std::size_t>(found_.size(), workers->threads()));
  for (Found& found : found_) found.changes.clear();
  workers->Run(changed_.size(), kGrainOfChanges,
               [&](std::size_t begin, std::size_t end, unsigned thread) {
                 std::vector<Change>& changes = found_[thread].changes;
                 const auto put = [&](std::size_t place, uint64_t value) {
                   STAGE_ASSERT(place < words());
                   changes.push_back({value, static_cast<uint32_t>(place)});
                 };
                 for (std::size_t i = begin; i < end; i++) PutChanged(grid, i, put);
               });
  grid.ForgetChangedOutlines();
  std::size_t count = 0;
  for (const Found& found : found_) count += found.changes.size();
  return count;
}

/// Calls put(place, value) for an entry of changed_.
template <typename Put>
void DeviceOutlines::PutChanged(const grid::Grid& grid, std::size_t entry, Put put) const {
  const auto& [index, tiles] = changed_[entry];
  if (entry >= changed_pairs_) return PutBody(grid, static_cast<grid::BodyId>(index), put);
  put(index, FirstOutlines(grid, index));
  grid::ForEachBit(tiles, [&](uint32_t tile) {
    PutOutlines(grid, static_cast<uint32_t>(2 * index) + tile, put);
  });
}

void DeviceOutlines::WriteChanges(uint64_t* values, uint32_t* places) const {
  for (const Found& found : found_)
    for (const Change& change : found.changes) {
      *values++ = change.value;
      *places++ = change.place;
    }
}

}  // namespace Stg::internal::sensing
