// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/island.hh"

#include "messages/assert.hh"

namespace Stg::motion {
namespace {

double Wrap(double angle) {
  // Angles are at most some turns away.
  return angle - 2.0 * M_PI * std::floor((angle + M_PI) / (2.0 * M_PI));
}

bool IsZero(const Motion& motion) {
  return motion.x == 0.0 && motion.y == 0.0 && motion.turn == 0.0;
}

bool Equal(const Motion& a, const Motion& b) {
  return a.x == b.x && a.y == b.y && a.turn == b.turn;
}

Motion Part(const Motion& motion, double part) {
  return {part * motion.x, part * motion.y, part * motion.turn};
}

/// Far from the origin, coordinates are taken relative to a point nearby: products of large ones
/// would be too coarse. Differences from it are exact.
double OriginNear(double position) {
  constexpr double kFar = 65536.0, kStep = 1024.0;
  return std::fabs(position) < kFar ? 0.0 : kStep * std::floor(position / kStep);
}

/// The greatest distance by which a motion takes a corner from its place.
double FarthestOf(const Motion& motion, double core) {
  return std::sqrt(motion.x * motion.x + motion.y * motion.y) +
         Least(std::fabs(motion.turn), 2.0) * core;
}

}  // namespace

// ---------------------------------------------------------------------------------------- loading

Hull IslandSolver::HullAt(const HullPlace& place) const {
  return {&corners_[place.first_corner], place.count, place.radius};
}

void IslandSolver::PlaceCorners(Body* body, const Shapes& shapes, const Columns& columns) {
  shapes.PlaceCorners(shapes.shapes[columns.shape[body->row]], body->position, body->heading,
                      corners_.data() + body->first_corner);
}

uint32_t IslandSolver::AddBody(uint32_t row, double reach, const Shapes& shapes,
                               const Columns& columns) {
  const Shape& shape = shapes.shapes[columns.shape[row]];
  Body body{};
  body.row = row;
  body.first_corner = static_cast<uint32_t>(corners_.size());
  body.position = Vector{columns.x[row], columns.y[row]} - origin_;
  body.heading = columns.heading[row];
  body.rest = {columns.target_x[row] - columns.x[row], columns.target_y[row] - columns.y[row],
               columns.turn[row]};
  body.grip = columns.grip[row];
  body.arm = columns.arm[row];
  body.core = shape.core;
  body.left = reach;
  body.bold = 1.0;
  body.pushable = columns.pushable[row] != 0;
  corners_.resize(corners_.size() + shape.corner_count);
  PlaceCorners(&body, shapes, columns);
  bodies_.push_back(body);
  return static_cast<uint32_t>(bodies_.size() - 1);
}

/// Keeps a pair if its pieces can touch within the step.
void IslandSolver::AddPairIfNear(Pair* pair) {
  const Body& a = bodies_[pair->a];
  const bool wall = pair->b == Nearby::kNone;
  const double reach = a.left + (wall ? 0.0 : bodies_[pair->b].left) + kTouch;
  const Separation found = Separate(HullAt(pair->hull_a), HullAt(pair->hull_b), {1.0, 0.0});
  if (found.gap >= reach) return;
  pair->normal = found.normal;
  pairs_.push_back(*pair);
}

void IslandSolver::AddPairs(uint32_t a, uint32_t b, const Shapes& shapes, const Columns& columns) {
  const uint32_t row_a = bodies_[a].row, row_b = bodies_[b].row;
  const Shape& shape_a = shapes.shapes[columns.shape[row_a]];
  const Shape& shape_b = shapes.shapes[columns.shape[row_b]];
  Pair pair{};
  pair.a = a;
  pair.b = b;
  pair.friction = 0.5 * (columns.friction[row_a] + columns.friction[row_b]);
  pair.kind = b >= members_                                ? Kind::kFixed
              : bodies_[a].pushable || bodies_[b].pushable ? Kind::kForce
                                                           : Kind::kSplit;
  uint32_t corner_a = bodies_[a].first_corner;
  for (uint32_t i = 0; i < shape_a.piece_count; i++) {
    const Piece& piece_a = shapes.pieces[shape_a.first_piece + i];
    pair.hull_a = {corner_a, piece_a.corner_count, piece_a.radius, piece_a.core};
    corner_a += piece_a.corner_count;
    uint32_t corner_b = bodies_[b].first_corner;
    for (uint32_t k = 0; k < shape_b.piece_count; k++) {
      const Piece& piece_b = shapes.pieces[shape_b.first_piece + k];
      pair.hull_b = {corner_b, piece_b.corner_count, piece_b.radius, piece_b.core};
      corner_b += piece_b.corner_count;
      if (Meet(piece_a.height, columns.elevation[row_a], piece_b.height, columns.elevation[row_b]))
        AddPairIfNear(&pair);
    }
  }
}

void IslandSolver::AddWallPairs(uint32_t a, uint32_t edge, const Shapes& shapes, const Walls& walls,
                                const Columns& columns) {
  const uint32_t row = bodies_[a].row;
  const Shape& shape = shapes.shapes[columns.shape[row]];
  const WallEdge& wall = walls.edges()[edge];
  Pair pair{};
  pair.a = a;
  pair.b = Nearby::kNone;
  pair.edge = edge;
  pair.friction = 0.5 * (columns.friction[row] + wall.friction);
  pair.kind = Kind::kFixed;
  pair.hull_b = {static_cast<uint32_t>(corners_.size()), 2, 0.0,
                 Length(wall.ends[1] - wall.ends[0])};
  corners_.push_back(wall.ends[0] - origin_);
  corners_.push_back(wall.ends[1] - origin_);
  uint32_t corner = bodies_[a].first_corner;
  for (uint32_t i = 0; i < shape.piece_count; i++) {
    const Piece& piece = shapes.pieces[shape.first_piece + i];
    pair.hull_a = {corner, piece.corner_count, piece.radius, piece.core};
    corner += piece.corner_count;
    if (Meet(piece.height, columns.elevation[row], wall.height, 0.0)) AddPairIfNear(&pair);
  }
}

void IslandSolver::Load(const Shapes& shapes, const Walls& walls, const Nearby& nearby,
                        const Island& island, const Columns& columns) {
  if (standing_.size() < columns.size()) standing_.resize(columns.size(), Nearby::kNone);
  for (const Body& body : bodies_) standing_[body.row] = Nearby::kNone;  // of the island before
  bodies_.clear();
  corners_.clear();
  pairs_.clear();
  const uint32_t first = nearby.members[island.first_member];
  origin_ = {OriginNear(columns.x[first]), OriginNear(columns.y[first])};
  for (uint32_t k = island.first_member; k < island.last_member; k++)
    AddBody(nearby.members[k], nearby.reach[nearby.members[k]], shapes, columns);
  members_ = bodies_.size();
  for (uint32_t k = island.first_pair; k < island.last_pair; k++) {
    uint32_t row_a = nearby.pairs[k].a, row_b = nearby.pairs[k].b;
    if (nearby.place[row_a] == Nearby::kNone) std::swap(row_a, row_b);
    uint32_t b = nearby.place[row_b];
    if (b == Nearby::kNone) {
      uint32_t& standing = standing_[row_b];
      if (standing == Nearby::kNone) standing = AddBody(row_b, 0.0, shapes, columns);
      b = standing;
    }
    AddPairs(nearby.place[row_a], b, shapes, columns);
  }
  for (uint32_t k = island.first_wall; k < island.last_wall; k++)
    AddWallPairs(nearby.place[nearby.walls[k].a], nearby.walls[k].b, shapes, walls, columns);
}

// --------------------------------------------------------------------------------------- contacts

/// Whether the nearest point is the end of an edge where the outline goes on, nearer to the body:
/// the next edge is in contact then, and this one must not stop what slides along both.
bool IslandSolver::BeyondEnd(const WallEdge& edge, const Separation& separation) const {
  const Vector toward_body = -separation.normal;
  const Vector along = edge.ends[1] - edge.ends[0];
  const double sideways = Dot(toward_body, along);
  if (sideways * sideways < 1e-12 * Dot(along, along)) return false;  // its side, not its end
  return Dot(toward_body, edge.beyond[separation.b]) > 1e-9;
}

void IslandSolver::FindTouches(const Walls& walls) {
  touches_.clear();
  for (size_t i = 0; i < members_; i++) bodies_[i].pushes = bodies_[i].pushable;
  for (Pair& pair : pairs_) {
    const Hull a = HullAt(pair.hull_a), b = HullAt(pair.hull_b);
    if (GapAcross(a, b, pair.normal) > kTouch) continue;  // their distance is at least that
    const Separation found = Separate(a, b, pair.normal);
    pair.normal = found.normal;
    if (found.gap > kTouch) continue;
    if (pair.b == Nearby::kNone && BeyondEnd(walls.edges()[pair.edge], found)) continue;
    AddTouch(pair, found);
  }
}

void IslandSolver::TellContacts(const Walls& walls, std::vector<Contact>* contacts) const {
  for (const Pair& pair : pairs_) {
    const Hull a = HullAt(pair.hull_a), b = HullAt(pair.hull_b);
    const bool wall = pair.b == Nearby::kNone;
    const Separation found = Separate(a, b, pair.normal);
    if (found.gap > kTouch || (wall && BeyondEnd(walls.edges()[pair.edge], found))) continue;
    const Manifold manifold = FindManifold(a, b, found);
    for (uint32_t k = 0; k < manifold.count; k++) {
      Contact contact{bodies_[pair.a].row,
                      wall ? walls.edges()[pair.edge].outline : bodies_[pair.b].row,
                      wall,
                      origin_ + 0.5 * (manifold.on_a[k] + manifold.on_b[k]),
                      manifold.normal,
                      manifold.gap[k]};
      if (!wall && contact.b < contact.a) {
        std::swap(contact.a, contact.b);
        contact.normal = -contact.normal;
      }
      contacts->push_back(contact);
    }
  }
}

// ---------------------------------------------------------------------------------------- motions

/// Sets what each body wants in this pass. Returns false if nobody wants anything.
bool IslandSolver::SetWanted() {
  bool any = false;
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    body.wanted = body.bold < 1.0 ? Part(body.rest, body.bold) : body.rest;
    any |= !IsZero(body.wanted);
  }
  return any;
}

/// No body goes farther than Nearby foresaw. A motion smaller than the error of the forces is
/// dropped, so that what is pressed together stands still.
void IslandSolver::CutMotions() {
  const double least = Least(kConverged, 1e-3 * typical_);
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    if (Distance(body.motion, {}, body.arm) < least) body.motion = {};
    if (FarthestOf(body.motion, body.core) <= body.left) continue;
    // The whole way of a corner, as a part of more than a turn may still be a long way.
    const double way =
        Length({body.motion.x, body.motion.y}) + std::fabs(body.motion.turn) * body.core;
    body.motion = Part(body.motion, body.left / way);
  }
}

Moving IslandSolver::MovingOf(uint32_t index, const HullPlace& place) const {
  if (index == Nearby::kNone)  // the edge of a wall
    return {HullAt(place), place.core, corners_[place.first_corner], {}};
  const Body& body = bodies_[index];
  return {HullAt(place), place.core, body.position, Part(body.motion, body.part)};
}

/// Lowers the parts of the motions that the bodies of each pair can make together. False if there
/// is nothing to lower. The order of the pairs has no influence.
bool IslandSolver::LowerParts(bool to_zero) {
  constexpr double kLeastPart = 0.01;
  bool any = false;
  for (Pair& pair : pairs_) {
    Body* a = &bodies_[pair.a];
    Body* b = pair.b < members_ ? &bodies_[pair.b] : nullptr;
    if (!a->dirty && (b == nullptr || !b->dirty)) continue;
    if (a->part == 0.0 && (b == nullptr || b->part == 0.0)) continue;
    double part =
        SafePart(MovingOf(pair.a, pair.hull_a), MovingOf(pair.b, pair.hull_b), pair.normal);
    if (part >= 1.0) continue;
    if (to_zero || part < kLeastPart) part = 0.0;
    any = true;
    for (Body* body : {a, b}) {
      if (body == nullptr || body->part == 0.0) continue;
      body->next_part = Least(body->next_part, body->part * part);
      body->next_dirty = true;
    }
  }
  return any;
}

/// All bodies move at once, each by a part of its motion with which no pair comes too near.
void IslandSolver::MoveTogether(int rounds, const Shapes& shapes, const Columns& columns) {
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    body.part = body.next_part = IsZero(body.motion) ? 0.0 : 1.0;
    body.dirty = true;
    body.next_dirty = false;
  }
  for (int round = 0; LowerParts(round >= rounds); round++)
    for (size_t i = 0; i < members_; i++) {
      Body& body = bodies_[i];
      body.part = body.next_part;
      body.dirty = body.next_dirty;
      body.next_dirty = false;
    }
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    if (body.part == 0.0) continue;
    Move(&body, columns);
    PlaceCorners(&body, shapes, columns);
  }
}

void IslandSolver::Move(Body* body, const Columns& columns) {
  const uint32_t row = body->row;
  const Motion made = Part(body->motion, body->part);
  body->turned += made.turn;
  // A body that nothing hindered arrives exactly where it would have without contacts.
  if (!body->moved && body->part == 1.0 && Equal(body->motion, body->rest)) {
    body->position = Vector{columns.target_x[row], columns.target_y[row]} - origin_;
    body->arrived = true;
    body->heading = columns.target_heading[row];
  } else {
    body->arrived = false;
    body->position = body->position + Vector{made.x, made.y};
    body->heading = Wrap(columns.heading[row] + body->turned);
  }
  body->moved = true;
}

/// Notes what is left to do. False if nothing is.
bool IslandSolver::NoteRest() {
  constexpr double kTimid = 0.25;
  bool more = false;
  for (size_t i = 0; i < members_; i++) {
    Body& body = bodies_[i];
    const double part = IsZero(body.motion) ? 1.0 : body.part;
    if (part < 1.0 || body.bold < 1.0) more = true;
    body.left = Most(0.0, body.left - FarthestOf(Part(body.motion, part), body.core));
    const Motion done = Part(body.wanted, part);
    body.rest = {body.rest.x - done.x, body.rest.y - done.y, body.rest.turn - done.turn};
    // Errors of the forces and of straight lines for curves shrink with the motion, the slack
    // between kSkin and kHard does not. So what could hardly move wants less the next time.
    body.bold = part < kTimid ? kTimid * body.bold : Least(1.0, 2.0 * body.bold);
  }
  return more;
}

void IslandSolver::Store(Columns* columns) const {
  for (size_t i = 0; i < members_; i++) {
    const Body& body = bodies_[i];
    const uint32_t row = body.row;
    const Motion wanted{columns->target_x[row] - columns->x[row],
                        columns->target_y[row] - columns->y[row], columns->turn[row]};
    const Vector position = body.arrived ? Vector{columns->target_x[row], columns->target_y[row]}
                                         : origin_ + body.position;
    const Motion missed{columns->target_x[row] - position.x, columns->target_y[row] - position.y,
                        body.arm * (wanted.turn - body.turned)};
    const auto square = [](const Motion& m) { return m.x * m.x + m.y * m.y + m.turn * m.turn; };
    const double whole = square({wanted.x, wanted.y, body.arm * wanted.turn});
    const double share = whole > 0.0 ? 1.0 - std::sqrt(square(missed) / whole) : 1.0;
    columns->made[row] = Clamp(share, 0.0, 1.0);
    columns->x[row] = position.x;
    columns->y[row] = position.y;
    columns->heading[row] = body.heading;
  }
}

void IslandSolver::FindContacts(const Shapes& shapes, const Walls& walls, const Nearby& nearby,
                                const Island& island, const Columns& columns,
                                std::vector<Contact>* contacts) {
  Load(shapes, walls, nearby, island, columns);
  TellContacts(walls, contacts);
}

void IslandSolver::Solve(const Shapes& shapes, const Walls& walls, const Nearby& nearby,
                         const Island& island, const Effort& effort, Columns* columns,
                         std::vector<Contact>* contacts) {
  Load(shapes, walls, nearby, island, *columns);
  for (int pass = 0; pass < effort.passes && SetWanted(); pass++) {
    SetMasses();
    FindTouches(walls);
    SolveForces(effort);
    CutMotions();
    MoveTogether(effort.joint_rounds, shapes, *columns);
    if (!NoteRest()) break;
  }
  Store(columns);
  if (contacts != nullptr) TellContacts(walls, contacts);
}

}  // namespace Stg::motion
