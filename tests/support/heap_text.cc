// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/heap_text.hh"

#include <cmath>
#include <sstream>

namespace test {
namespace {

template <typename... Parts>
std::string Text(const Parts&... parts) {
  std::ostringstream text;
  text.precision(12);
  (text << ... << parts);
  return text.str();
}

// Heights are multiples of a quarter, so that sums are exact and bodies may meet exactly.
constexpr double kHeights[] = {0.25, 0.25, 0.5, 1.0, 0.0};
constexpr double kElevations[] = {0, 0, 0, 0, 0, 0.25, 0.5};

}  // namespace

HeapText::HeapText(uint64_t seed) : random_(seed * 7919 + 1) {
  const double intervals[] = {1, 10, 20, 100, 100, 333, 1000};
  interval_ = OneOf(intervals);
  const double speeds[] = {0.05, 0.3, 0.3, 1, 3, 20, 100, 0};
  speed_ = OneOf(speeds);
  const double cells[] = {0.05, 0.1, 0.3};
  const double centers[] = {0, 0, 0, 1000.3, -1e5, 3e4};
  center_x_ = OneOf(centers);
  center_y_ = OneOf(centers);
  half_ = Between(1.2, 2.5);
  closed_ = Chance(0.85);
  may_overlap_ = Chance(0.4);
  text_ = Text("contacts \"outlines\"\nresolution ", OneOf(cells), "\ninterval_sim ", interval_,
               "\nray_model \"", Chance(0.5) ? "exact" : "cell", "\"\n");
  if (closed_) AddFrame();
  if (Chance(0.3)) AddDoor();
  for (uint32_t i = random_.Choose(6); i > 0; i--) AddRandomWall();
  if (Chance(0.4)) AddChain();
  if (Chance(0.3)) AddCup();
  const uint32_t bodies = 8 + random_.Choose(28);
  for (uint32_t i = 0; i < bodies; i++) {
    const double size = Chance(0.2)    ? Between(0.005, 0.03)
                        : Chance(0.05) ? Between(0.8, 1.5)
                                       : Between(0.1, 0.5);
    Place place;
    if (!FindPlace(0.75 * size, &place)) continue;
    Chance(0.65) ? AddRobot(place, size) : AddThing(place, size);
  }
}

std::vector<Stg::point_t> HeapText::room() const {
  std::vector<Stg::point_t> corners;
  if (closed_)
    for (const double side : {-half_, half_})
      for (const double top : {-half_, half_})
        corners.emplace_back(center_x_ + side, center_y_ + (side < 0 ? top : -top));
  return corners;
}

/// Finds a place that no other body covers, unless bodies may overlap.
bool HeapText::FindPlace(double radius, Place* place) {
  for (int attempt = 0; attempt < 20; attempt++) {
    *place = {Between(-half_, half_), Between(-half_, half_), radius};
    bool free = true;
    for (const Place& other : places_) {
      const double dx = other.x - place->x, dy = other.y - place->y;
      const double far = other.radius + radius;
      free = free && dx * dx + dy * dy > far * far;
    }
    if (!free && !may_overlap_) continue;
    places_.push_back(*place);
    return true;
  }
  return false;
}

std::string HeapText::Pose(double x, double y, double z, double heading) const {
  return Text(" pose [", center_x_ + x, " ", center_y_ + y, " ", z, " ", heading, "]");
}

std::string HeapText::Surface() {
  const double frictions[] = {0, 0, 0.2, 0.5, 1.5};
  const double masses[] = {0, 0.5, 3, 10, 80};
  std::string text = Text(" friction ", OneOf(frictions), " mass ", OneOf(masses));
  if (Chance(0.2)) text += Text(" floor_friction ", Chance(0.2) ? 0.0 : Between(0.05, 2));
  return text;
}

// ---- walls --------------------------------------------------------------------------------------

void HeapText::AddWall(double x, double y, double heading, double length, double thickness,
                       const std::string& more) {
  text_ += Text("model(", Pose(x, y, 0, heading), " size [", length, " ", thickness, " 1]",
                more.empty() ? Surface() : more, " )\n");
}

/// Encloses the square, by four walls or by the outline of a hollow one.
void HeapText::AddFrame() {
  const double side = 2 * half_;
  const auto name = [this] { return Text(" name \"frame", count_++, "\" friction 0.3"); };
  if (Chance(0.3)) return AddWall(0, 0, 0, side, side, name());
  const double thickness = Chance(0.3) ? 0.001 : 0.1, middle = half_ + 0.5 * thickness;
  for (const double sign : {-1.0, 1.0}) {
    AddWall(sign * middle, 0, 90, side + 2 * thickness, thickness, name());
    AddWall(0, sign * middle, 0, side + 2 * thickness, thickness, name());
  }
}

/// A wall across the square with a gap that most bodies hardly fit through.
void HeapText::AddDoor() {
  const double width = Between(0.2, 0.6), at = Between(-0.5, 0.5) * half_;
  const double low = at - 0.5 * width + half_, high = half_ - at - 0.5 * width;
  AddWall(-half_ + 0.5 * low, 0, 0, low, 0.02);
  AddWall(half_ - 0.5 * high, 0, 0, high, 0.02);
}

void HeapText::AddRandomWall() {
  const double x = Between(-half_, half_), y = Between(-half_, half_);
  const double heading = Chance(0.3) ? 90.0 * random_.Choose(4) : Between(-180, 180);
  const double size = Between(0.1, 1);
  if (Chance(0.4)) return AddWall(x, y, heading, size, 0.001);
  std::string suffix;
  const std::string body = Body(size, &suffix);
  text_ += Text("model( name \"wall", count_++, suffix, "\"",
                Pose(x, y, OneOf(kElevations), heading), body, Surface(), " )\n");
}

// ---- bodies -------------------------------------------------------------------------------------

/// A polygon whose corners have distances from `inner` to 1 times `reach`: a star, which may be
/// convex, or intersects itself now and then.
std::string HeapText::Polygon(double reach, double inner, int corners, bool may_be_wild) {
  const bool wild = may_be_wild && Chance(0.05);
  std::string text = Text(" block( points ", corners);
  for (int i = 0; i < corners; i++) {
    const double angle = wild ? Between(0, 2 * M_PI) : 2 * M_PI * i / corners;
    const double radius = reach * (i % 2 == 0 ? 1 : Between(inner, 1));
    text += Text(" point[", i, "] [", radius * std::cos(angle), " ", radius * std::sin(angle), "]");
  }
  const bool low = Chance(0.8);
  return text + (low ? " z [0 1] )" : " z [0 2] )");
}

std::string HeapText::Body(double size, std::string* suffix) {
  const double height = OneOf(kHeights);
  std::string text = Text(" size [", size, " ", size, " ", height, "]");
  if (Chance(0.1)) text += Text(" origin [", 0.3 * size, " ", -0.2 * size, " 0 30]");
  switch (random_.Choose(8)) {
    case 0:
    case 1:
      *suffix = "_round";
      return text + " round 1";
    case 2:
      return text;
    case 3:
      return Text(" size [", size, " ", Between(0.001, 0.02), " ", height, "]");
    case 4: {
      if (Chance(0.5)) return text + Polygon(1, 1, 3 + static_cast<int>(random_.Choose(9)));
      *suffix = "_round";  // a regular polygon of so many corners counts as a disc
      const int corners[] = {12, 13, 16, 20};
      return text + Polygon(1, 1, OneOf(corners), false);
    }
    case 5:
      return text +
             " block( points 6 point[0] [0 0] point[1] [3 0] point[2] [3 1] point[3] [1 1] "
             "point[4] [1 3] point[5] [0 3] z [0 1] )";
    case 6:
      return text + Polygon(1, 1, 3) + Polygon(0.5, 0.3, 8);
    default:
      return text + Polygon(1, 0.3, 5 + static_cast<int>(random_.Choose(10)));
  }
}

/// Sensors, and bodies on top or beside, some of which move by themselves.
std::string HeapText::Children(double size) {
  std::string text;
  if (Chance(0.25))
    text += " ranger( alwayson 1 sensor( samples 9 range [0 3] fov 270 noise [0.001 0.01 0] ) )";
  if (Chance(0.1))
    text += Text(" bumper( alwayson 1 bcount 1 bpose[0] [", 0.5 * size, " 0 0 0] blength ", size,
                 " size [0 0 0] )");
  if (Chance(0.15))
    text += Text(" model( pose [", Between(-0.3, 0.3) * size, " 0 0 40] size [", 1.2 * size, " ",
                 0.3 * size, " 0.25] )");
  if (Chance(0.12))
    text +=
        Text(" actuator( alwayson 1 type \"", Chance(0.5) ? "linear" : "rotational", "\" pose [",
             0.5 * size, " 0 0 0] size [", 0.8 * size, " ", 0.1 * size, " 0.25] max_position ",
             Chance(0.5) ? size : 3.0, " min_position -0.5 max_speed ", speed_ + 1, " )");
  if (Chance(0.06))
    text += Text(" position( alwayson 1 drive \"omni\" size [", 0.3 * size, " ", 0.3 * size,
                 " 0.25] velocity_bounds [", -speed_, " ", speed_, " ", -speed_, " ", speed_,
                 " 0 0 -90 90] )");
  if (Chance(0.06))
    text += Text(" gripper( alwayson 1 pose [", 0.7 * size, " 0 -0.25 0] size [", 0.5 * size, " ",
                 0.6 * size, " 0.25] )");
  return text;
}

void HeapText::AddRobot(const Place& place, double size) {
  const char* drives[] = {"diff", "omni", "car"};
  const int update = static_cast<int>(interval_ < 1 ? 1 : interval_);
  std::string suffix;
  const std::string body = Body(size, &suffix);
  text_ += Text("position( name \"r", count_++, suffix, "\" alwayson 1 drive \"", OneOf(drives),
                "\" wheelbase ", 0.5 * size, " update_interval ", update, " velocity_bounds [",
                -speed_, " ", speed_, " ", -speed_, " ", speed_, " 0 0 -400 400]",
                Pose(place.x, place.y, OneOf(kElevations), Between(-180, 180)), body, Surface());
  if (Chance(0.35)) text_ += " pushable 1";
  if (Chance(0.3)) text_ += " localization \"odom\" odom_noise [0.02 0.01 2 1] wheel_slip 0.5";
  if (Chance(0.1)) text_ += " joules 50";
  if (Chance(0.1)) text_ += " limit_acceleration 1";
  if (Chance(0.3)) text_ += " stack_children 0";
  text_ += Children(size) + " )\n";
}

void HeapText::AddThing(const Place& place, double size) {
  std::string suffix;
  const std::string body = Body(size, &suffix);
  text_ +=
      Text("model( name \"t", count_++, suffix, "\" pushable 1 gripper_return ", Chance(0.3),
           Pose(place.x, place.y, OneOf(kElevations), Between(-180, 180)), body, Surface(), " )\n");
}

/// A row of things, nearly in contact, with a robot behind them; sometimes in a corridor.
void HeapText::AddChain() {
  const double size = Between(0.15, 0.3), y = Between(-0.6, 0.6) * half_;
  const double gap = Chance(0.5) ? 0.0005 : Between(0.001, 0.03);
  const uint32_t things = 2 + random_.Choose(5);
  double x = -0.8 * half_;
  for (uint32_t i = 0; i <= things; i++, x += size + gap) {
    places_.push_back({x, y, 0.75 * size});
    const bool round = Chance(0.3);
    const std::string common = Text(round ? "_round\" round 1" : "\"", Pose(x, y, 0, 0), " size [",
                                    size, " ", size, " 0.5]", Surface());
    if (i == 0)
      text_ +=
          Text("position( name \"pusher", count_++, common, " alwayson 1 velocity [", 0.3 * speed_,
               " 0 0 0] velocity_bounds [", -speed_, " ", speed_, " 0 0 0 0 -90 90] )\n");
    else
      text_ += Text("model( name \"link", count_++, common, " pushable 1 )\n");
  }
  if (!Chance(0.5)) return;
  for (const double side : {-1.0, 1.0})
    AddWall(-0.2 * half_, y + side * (0.5 * size + 0.02), 0, half_, 0.02);
}

/// A concave thing with a robot inside.
void HeapText::AddCup() {
  Place place;
  if (!FindPlace(0.6, &place)) return;
  text_ += Text(
      "model( name \"cup", count_++, "\" pushable 1 ", Pose(place.x, place.y, 0, Between(0, 360)),
      " size [0.8 0.8 0.5] block( points 8 point[0] [0 0] point[1] [8 0] point[2] [8 8] "
      "point[3] [0 8] point[4] [0 7] point[5] [7 7] point[6] [7 1] point[7] [0 1] z [0 1] )",
      Surface(), " )\n");
  AddRobot(place, 0.3);
}

}  // namespace test
