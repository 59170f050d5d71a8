// SPDX-License-Identifier: GPL-2.0-or-later
//
// Moves of a step with contacts of outlines. Models become rows of columns, whose motion module
// `motion` computes; new poses are written back to the models.
//
// A tree has a row if it can move: if its root drives or is pushable, or if a model of it moves by
// itself, such as an actuator or a gripper. Other trees are walls.

#ifndef STAGE_WORLD_PHASES_CONTACT_PHASE_HH
#define STAGE_WORLD_PHASES_CONTACT_PHASE_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "models/contact_outline.hh"
#include "models/model.hh"
#include "motion/columns.hh"
#include "motion/contacts.hh"
#include "motion/shape.hh"
#include "motion/walls.hh"

namespace Stg {

class WorldEngine;

class ContactPhase {
 public:
  /// The greatest force that the floor exerts on a tree of models with this total mass in kg, in
  /// newtons.
  static double GripOf(double mass, double floor_friction, bool is_robot);
  /// Moves all roots that have rows, without changing the grid. `seconds`: duration of a step.
  void Run(WorldEngine* engine, double seconds);
  /// Roots whose poses Run() has changed, in the order of creation. They must be rasterized.
  std::span<Model* const> moved() const { return moved_; }
  /// Finds shapes and walls again if the world has changed otherwise than by moves of whole trees.
  void Refresh(WorldEngine* engine);
  /// True if the model's tree, now that the model is no more at `before`, is in another body,
  /// deeper than it was. Refresh() must have been called when the model was at `before`.
  bool IsBlocked(const Model& model, const Pose& before, WorldEngine* engine);
  /// Finds the contacts at the present poses, unless they are known.
  void FindContacts(WorldEngine* engine);
  /// See Host::ForEachContact(). Call FindContacts() before.
  void ForEachContact(const Model* root, const std::function<void(const ContactPoint&)>& f) const;

  // Results of Refresh(). The columns are in the order of creation of the roots.
  const motion::Shapes& shapes() const { return shapes_; }
  const motion::Walls& walls() const { return walls_; }
  const motion::Columns& columns() const { return columns_; }
  std::span<Model* const> roots() const { return roots_; }
  /// The model of each outline of a wall.
  std::span<const Model* const> wall_models() const { return wall_models_; }
  /// The bottom of the outline of the row's tree, above its pose, metres.
  double BottomOf(size_t row) const { return bottoms_[columns_.shape[row]]; }

 private:
  struct ContactOfRow {
    uint32_t row;
    ContactPoint point;
  };
  void FindAll(WorldEngine* engine);
  void FindChanged(WorldEngine* engine);
  void FindWalls(WorldEngine* engine);
  static bool HasRow(const Model& root);
  void AddRow(Model* root);
  void AddWalls(const Model& root);
  uint32_t ShapeOf(const Model& root);
  void ReadPoses(size_t begin, size_t end);
  void ReadTarget(Model* model);
  void WritePoses(size_t begin, size_t end, double seconds);
  Velocity MadeVelocity(size_t row, const Pose& before, double seconds) const;
  void ListMoved();
  void ListContacts();

  motion::Shapes shapes_;
  motion::Walls walls_;
  motion::Columns columns_;
  motion::Contacts contacts_;
  std::unordered_map<std::string, uint32_t> shape_numbers_;  // by ContactOutline::Key()
  std::vector<double> bottoms_;                              // of each shape
  ContactOutline outline_;
  uint64_t topology_version_ = 0;
  std::vector<Model*> roots_;              // of each row
  std::vector<const Model*> wall_models_;  // of each outline of walls_
  std::vector<Model::WantedMove> wanted_;  // of each row
  static constexpr uint8_t kAsked = 1, kMoved = 2, kInFloor = 4;
  std::vector<uint8_t> marks_;  // of each row
  std::vector<Model*> moved_;
  std::vector<ContactOfRow> touching_;  // sorted by row; see Host::contacts_known
};

}  // namespace Stg

#endif
