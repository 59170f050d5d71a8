// SPDX-License-Identifier: GPL-2.0-or-later
//
// A check that bodies of a world do not overlap and are not inside of each other, which shares no
// code with what it checks.

#ifndef STAGE_TESTS_SUPPORT_OVERLAPS_HH
#define STAGE_TESTS_SUPPORT_OVERLAPS_HH

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "stage.hh"

namespace test {

/// Outlines of all obstacles of a world, in the world's frame.
class PlacedOutlines {
 public:
  /// `room`: the inner faces of walls that enclose a polygon, if any.
  explicit PlacedOutlines(const Stg::World& world, const std::vector<Stg::point_t>& room = {});

  /// Bodies that overlap now and did not overlap before, and bodies that are now inside of a wall's
  /// outline, or outside, and were not; empty if there are none. Bodies that have changed their
  /// shape other than by an arm are not compared.
  std::string FaultsSince(const PlacedOutlines& before) const;

  size_t overlaps() const { return overlaps_.size(); }
  /// Bodies that can move.
  size_t movers() const { return movers_; }

 private:
  using Pair = std::pair<uint64_t, uint64_t>;
  struct Outline {
    uint64_t key;   // see Key()
    uint32_t root;  // number of the tree's root
    bool mover, simple;
    bool has_side;  // of a mover: whether it must stay inside or outside of walls
    double bottom, top;
    double radius;  // 0: a polygon
    std::vector<Stg::point_t> corners;
    Stg::point_t middle;
    double reach;  // distance of the farthest point from `middle`
  };
  void AddTree(const Stg::Model& model, const Stg::Model& root, bool mover, bool loose);
  void AddBody(const Stg::Model& model, const Stg::Model& root, bool mover, bool loose);
  void AddRoom(const std::vector<Stg::point_t>& room);
  void Compare(const Outline& a, const Outline& b);
  static bool MayMeet(const Outline& a, const Outline& b);
  static bool MayTouch(const Outline& a, const Outline& b);
  static bool Overlap(const Outline& a, const Outline& b);

  std::vector<Outline> outlines_;
  std::vector<Pair> overlaps_;    // sorted
  std::map<Pair, bool> insides_;  // movers and closed walls that do not overlap: whether inside
  std::map<uint32_t, std::string> states_;  // of the tree of each root: what changes its shape
  std::map<uint64_t, std::string> names_;   // of each model
  size_t movers_ = 0;
};

}  // namespace test

#endif
