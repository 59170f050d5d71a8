// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random worlds of bodies close together, for tests of contacts of outlines.

#ifndef STAGE_TESTS_SUPPORT_HEAP_TEXT_HH
#define STAGE_TESTS_SUPPORT_HEAP_TEXT_HH

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "random/random.hh"

namespace test {

/// A world file with contacts of outlines, determined by a seed. It has walls, doors, robots of all
/// drives and things to push: concave, thin, tiny, huge and without height, with children on top
/// and arms. Some overlap at the start. Names of discs end in "_round".
class HeapText {
 public:
  explicit HeapText(uint64_t seed);
  const std::string& text() const { return text_; }
  /// Greatest speed that robots are commanded, m/s.
  double speed() const { return speed_; }
  /// Half the side of the square that bodies start in, and its centre, m.
  double half() const { return half_; }
  double center_x() const { return center_x_; }
  double center_y() const { return center_y_; }
  /// The inner faces of walls that enclose that square; empty if there are none. The names of these
  /// walls begin with "frame".
  std::vector<Stg::point_t> room() const;

 private:
  struct Place {
    double x, y, radius;
  };
  bool Chance(double probability) { return random_.Uniform() < probability; }
  double Between(double low, double high) { return random_.Uniform(low, high); }
  template <typename T, size_t n>
  T OneOf(const T (&values)[n]) {
    return values[random_.Choose(n)];
  }
  std::string Pose(double x, double y, double z, double heading) const;
  std::string Surface();
  std::string Polygon(double reach, double inner, int corners, bool may_be_wild = true);
  std::string Body(double size, std::string* suffix);
  std::string Children(double size);
  void AddWall(double x, double y, double heading, double length, double thickness,
               const std::string& more = "");
  void AddFrame();
  void AddDoor();
  void AddRandomWall();
  void AddChain();
  void AddCup();
  void AddRobot(const Place& place, double size);
  void AddThing(const Place& place, double size);
  bool FindPlace(double radius, Place* place);

  Stg::RandomStream random_;
  std::string text_;
  double speed_, half_, center_x_, center_y_;
  double interval_;  // ms
  bool closed_, may_overlap_;
  int count_ = 0;  // of bodies
  std::vector<Place> places_;
};

}  // namespace test

#endif
