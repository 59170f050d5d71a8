// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/phases/contact_phase.hh"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "models/model_type.hh"
#include "motion/odometry.hh"
#include "motion/separation.hh"
#include "world/engine.hh"
#include "world/phases/moves_tree.hh"

namespace Stg {

namespace {

constexpr double kGravity = 9.80665;                     // m/s^2
constexpr double kUsualRobot = 10.0, kUsualThing = 1.0;  // kg, of models without a mass
constexpr double kLeastGrip = 1e-6;                      // N
constexpr size_t kRowGrain = 64;
constexpr size_t kSpareShapes = 1000;  // then shapes that nobody uses are dropped

bool AnyMoves(const Model& model) {
  const ModelType* const type = FindModelType(model);
  if (!type || type->moves != ModelType::kStays) return true;
  return std::ranges::any_of(model.GetChildren(),
                             [](const Model* child) { return AnyMoves(*child); });
}

}  // namespace

// ---- columns ------------------------------------------------------------------------------------

bool ContactPhase::HasRow(const Model& root) { return root.IsPushable() || AnyMoves(root); }

/// The number of the shape of a tree. Trees of equal shapes share one.
uint32_t ContactPhase::ShapeOf(const Model& root) {
  outline_.Find(root, Pose());
  const auto [known, is_new] =
      shape_numbers_.try_emplace(outline_.Key(), static_cast<uint32_t>(shapes_.shapes.size()));
  if (is_new) {
    known->second = outline_.AddTo(&shapes_);
    bottoms_.push_back(outline_.Bottom());
  }
  return known->second;
}

double ContactPhase::GripOf(double mass, double floor_friction, bool is_robot) {
  const double weight = (mass > 0 ? mass : is_robot ? kUsualRobot : kUsualThing) * kGravity;
  return std::max(kLeastGrip, weight * floor_friction);
}

void ContactPhase::AddRow(Model* root) {
  const bool robot = root->Drives();
  motion::Row row;
  row.shape = ShapeOf(*root);
  row.group = root->GetId();
  row.pushable = root->IsPushable();
  row.grip = GripOf(root->GetTotalMass(), root->GetFloorFriction(), robot);
  row.friction = root->GetFriction();
  root->contact_row_ = static_cast<uint32_t>(roots_.size());
  columns_.Add(row, shapes_.shapes[row.shape]);
  roots_.push_back(root);
  if (row.pushable && !robot) {
    if (!root->pose_before_push_) root->pose_before_push_ = std::make_unique<Pose>(root->pose);
  } else {
    root->pose_before_push_.reset();
  }
}

void ContactPhase::AddWalls(const Model& root) {
  outline_.Find(root, root.GetGlobalPose());
  outline_.AddTo(&walls_, root.GetId());
  for (const ContactOutline::Part& part : outline_.parts) wall_models_.push_back(part.model);
}

void ContactPhase::FindWalls(WorldEngine* engine) {
  walls_ = motion::Walls();
  wall_models_.clear();
  for (const Model* model : engine->models)
    if (!model->Parent() && model->contact_row_ == Model::kNoRow) AddWalls(*model);
  walls_.Index();
}

void ContactPhase::FindAll(WorldEngine* engine) {
  shapes_ = motion::Shapes();
  shape_numbers_.clear();
  bottoms_.clear();
  columns_ = motion::Columns();
  roots_.clear();
  for (Model* model : engine->models) {
    model->contact_row_ = Model::kNoRow;
    if (!model->Parent() && HasRow(*model)) AddRow(model);
  }
  wanted_.resize(roots_.size());
  marks_.assign(roots_.size(), 0);
  FindWalls(engine);
}

/// Finds shapes and walls again if the world has changed otherwise than by moves of whole trees.
void ContactPhase::Refresh(WorldEngine* engine) {
  if (topology_version_ == engine->topology_version && !engine->contacts_changed &&
      engine->changed_outlines.empty())
    return;
  const bool all = topology_version_ != engine->topology_version || engine->contacts_changed ||
                   shapes_.shapes.size() > roots_.size() + kSpareShapes;
  engine->contacts_changed = true;  // unless this succeeds
  if (all)
    FindAll(engine);
  else
    FindChanged(engine);
  topology_version_ = engine->topology_version;
  engine->changed_outlines.clear();
  engine->contacts_changed = false;
}

/// Finds the outlines of changed trees again.
void ContactPhase::FindChanged(WorldEngine* engine) {
  bool walls_changed = false;
  for (const Model* root : engine->changed_outlines) {
    if (root->contact_row_ == Model::kNoRow) {
      walls_changed = true;
      continue;
    }
    const uint32_t shape = ShapeOf(*root);
    columns_.SetShape(root->contact_row_, shape, shapes_.shapes[shape]);
  }
  if (walls_changed) FindWalls(engine);
}

// ---- steps --------------------------------------------------------------------------------------

void ContactPhase::ReadPoses(size_t begin, size_t end) {
  for (size_t i = begin; i < end; i++) {
    const Pose& pose = roots_[i]->pose;
    columns_.x[i] = columns_.target_x[i] = pose.x;
    columns_.y[i] = columns_.target_y[i] = pose.y;
    columns_.heading[i] = columns_.target_heading[i] = pose.a;
    columns_.turn[i] = 0;
    columns_.elevation[i] = pose.z;
    columns_.made[i] = 1;
    marks_[i] = 0;
    wanted_[i].pose = pose;
  }
}

void ContactPhase::ReadTarget(Model* model) {
  const uint32_t row = model->contact_row_;
  Model::WantedMove& wanted = wanted_[row];
  if (!model->GetWantedMove(&wanted)) return;
  marks_[row] |= kAsked;
  columns_.elevation[row] = wanted.pose.z;
  if (bottoms_[columns_.shape[row]] + wanted.pose.z < 0) {  // it would be in the floor
    columns_.elevation[row] = model->pose.z;
    marks_[row] |= kInFloor;
    return;
  }
  columns_.target_x[row] = wanted.pose.x;
  columns_.target_y[row] = wanted.pose.y;
  columns_.target_heading[row] = wanted.pose.a;
  columns_.turn[row] = wanted.turn;
}

/// The velocity of the motion that was made, in the frame of the body before it.
Velocity ContactPhase::MadeVelocity(size_t row, const Pose& before, double seconds) const {
  const Model::WantedMove& wanted = wanted_[row];
  const Pose& now = roots_[row]->pose;
  if ((marks_[row] & kAsked) && now == wanted.pose) return wanted.velocity;
  return motion::VelocityBetween(before, now, seconds);
}

void ContactPhase::WritePoses(size_t begin, size_t end, double seconds) {
  for (size_t i = begin; i < end; i++) {
    Model& root = *roots_[i];
    const Pose before = root.pose;
    if (root.pose_before_push_) *root.pose_before_push_ = before;
    const Pose now(columns_.x[i], columns_.y[i], columns_.elevation[i], columns_.heading[i]);
    if (!(now == before)) {
      root.pose = now;
      marks_[i] |= kMoved;
    }
    if (marks_[i] & kAsked)
      root.stall = columns_.made[i] < motion::kHindered || (marks_[i] & kInFloor);
    root.EndMove(MadeVelocity(i, before, seconds));
  }
}

void ContactPhase::ListMoved() {
  moved_.clear();
  for (size_t i = 0; i < roots_.size(); i++)
    if (marks_[i] & kMoved) moved_.push_back(roots_[i]);
}

/// Lists each contact for both rows, so that those of a row are adjacent.
void ContactPhase::ListContacts() {
  touching_.clear();
  for (const motion::Contact& contact : contacts_.contacts()) {
    ContactPoint point;
    point.a = roots_[contact.a];
    point.b = contact.wall ? const_cast<Model*>(wall_models_[contact.b]) : roots_[contact.b];
    point.point = point_t(contact.point.x, contact.point.y);
    point.normal = point_t(contact.normal.x, contact.normal.y);
    point.gap = contact.gap;
    touching_.push_back({contact.a, point});
    if (contact.wall) continue;
    std::swap(point.a, point.b);
    point.normal = point_t(-contact.normal.x, -contact.normal.y);
    touching_.push_back({contact.b, point});
  }
  std::ranges::stable_sort(touching_, {}, &ContactOfRow::row);
}

void ContactPhase::Run(WorldEngine* engine, double seconds) {
  Refresh(engine);
  threads::WorkerPool* const workers =
      engine->parallel_choice.is_parallel() ? engine->workers() : nullptr;
  threads::RunOn(workers, roots_.size(), kRowGrain,
                 [this](size_t begin, size_t end, unsigned) { ReadPoses(begin, end); });
  const std::vector<Model*>& moving = engine->moving;
  threads::RunOn(workers, moving.size(), kRowGrain, [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++)
      if (MovesTree(*moving[i])) ReadTarget(moving[i]);
  });
  contacts_.tell = false;  // FindContacts() is called by those who want them
  contacts_.Step(shapes_, walls_, &columns_, workers);
  threads::RunOn(workers, roots_.size(), kRowGrain,
                 [&](size_t begin, size_t end, unsigned) { WritePoses(begin, end, seconds); });
  ListMoved();
  engine->contacts_known = false;
}

// ---- contacts -----------------------------------------------------------------------------------

void ContactPhase::FindContacts(WorldEngine* engine) {
  if (engine->contacts_known) return;
  touching_.clear();
  if (engine->contact_model == ContactModel::kOutlines) {
    Refresh(engine);
    ReadPoses(0, roots_.size());
    contacts_.FindContacts(shapes_, walls_, columns_);
    ListContacts();
  }
  engine->contacts_known = true;
}

void ContactPhase::ForEachContact(const Model* root,
                                  const std::function<void(const ContactPoint&)>& f) const {
  if (root == nullptr) {
    // Between two rows, each contact is listed twice.
    for (const ContactOfRow& touch : touching_)
      if (touch.point.b->contact_row_ == Model::kNoRow || touch.row < touch.point.b->contact_row_)
        f(touch.point);
    return;
  }
  if (root->contact_row_ == Model::kNoRow) return;
  const uint32_t row = root->contact_row_;
  auto touch = std::ranges::lower_bound(touching_, row, {}, &ContactOfRow::row);
  for (; touch != touching_.end() && touch->row == row; ++touch) f(touch->point);
}

namespace {

/// The pieces of a tree at its pose.
struct PlacedTree {
  motion::Shapes shapes;
  std::vector<motion::Vector> corners;
  double bound = 0;

  void Place(const ContactOutline& outline, const Pose& pose) {
    shapes = motion::Shapes();
    outline.AddTo(&shapes);
    bound = shapes.shapes[0].bound;
    Place(shapes, shapes.shapes[0], pose);
  }
  void Place(const motion::Shapes& all, const motion::Shape& shape, const Pose& pose) {
    corners.resize(shape.corner_count);
    all.PlaceCorners(shape, {pose.x, pose.y}, pose.a, corners.data());
  }
};

/// Calls f(hull, height) for each piece of a shape.
template <typename F>
void ForEachPiece(const motion::Shapes& all, const motion::Shape& shape,
                  const std::vector<motion::Vector>& corners, F f) {
  const motion::Vector* corner = corners.data();
  for (uint32_t i = 0; i < shape.piece_count; i++) {
    const motion::Piece& piece = all.pieces[shape.first_piece + i];
    f(motion::Hull{corner, piece.corner_count, piece.radius}, piece.height);
    corner += piece.corner_count;
  }
}

}  // namespace

/// Compares the present outline and pose of the tree with those before: no gap may get smaller than
/// kHard.
bool ContactPhase::IsBlocked(const Model& model, const Pose& before_move, WorldEngine* engine) {
  Refresh(engine);
  const Model& root = *model.Root();
  const uint32_t row = root.contact_row_;
  if (row == Model::kNoRow) return false;
  outline_.Find(root, Pose());
  const Pose& pose = root.pose;
  if (outline_.Bottom() + pose.z < 0) return true;
  if (outline_.parts.empty()) return false;
  PlacedTree now, before, other;
  now.Place(outline_, pose);
  const motion::Shape& shape_before = shapes_.shapes[columns_.shape[row]];
  before.Place(shapes_, shape_before, &model == &root ? before_move : pose);
  // True if some piece is too near to `hull`, and nearer than all pieces were.
  const auto blocks = [&](const motion::Hull& hull, const motion::Interval& height, double lift) {
    const auto least_gap = [&](const motion::Shapes& all, const motion::Shape& shape,
                               const std::vector<motion::Vector>& corners) {
      double least = INFINITY;
      ForEachPiece(all, shape, corners, [&](const motion::Hull& own, const motion::Interval& z) {
        if (motion::Meet(z, pose.z, height, lift))
          least = std::min(least, motion::Separate(own, hull, {1.0, 0.0}).gap);
      });
      return least;
    };
    const double gap = least_gap(now.shapes, now.shapes.shapes[0], now.corners);
    return gap < motion::kHard && gap < least_gap(shapes_, shape_before, before.corners);
  };
  bool blocked = false;
  const double bound = now.bound;
  walls_.ForEachNear({pose.x - bound, pose.y - bound, pose.x + bound, pose.y + bound},
                     [&](uint32_t k) {
                       const motion::WallEdge& edge = walls_.edges()[k];
                       blocked = blocked || blocks({edge.ends, 2, 0}, edge.height, 0);
                     });
  for (size_t i = 0; i < roots_.size() && !blocked; i++) {
    if (i == row) continue;
    const motion::Shape& shape = shapes_.shapes[columns_.shape[i]];
    const Pose& at = roots_[i]->pose;
    const double dx = at.x - pose.x, dy = at.y - pose.y, far = bound + shape.bound;
    if (dx * dx + dy * dy > far * far) continue;
    other.Place(shapes_, shape, at);
    ForEachPiece(shapes_, shape, other.corners,
                 [&](const motion::Hull& hull, const motion::Interval& height) {
                   blocked = blocked || blocks(hull, height, at.z);
                 });
  }
  return blocked;
}

}  // namespace Stg
