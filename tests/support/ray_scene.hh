// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random grids and fans without models for tests of the ray walk, and the hits that are expected in
// them. The same seed gives the same scene. The resolution is one metre.

#ifndef STAGE_TESTS_SUPPORT_RAY_SCENE_HH
#define STAGE_TESTS_SUPPORT_RAY_SCENE_HH

#include <cstdint>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "random/random.hh"
#include "sensing/batch.hh"
#include "sensing/prefilter.hh"

namespace ray_scene {

class RayScene {
 public:
  explicit RayScene(uint64_t seed);

  /// Changes, removes and adds bodies. Sometimes it adds so many far away that their removal drops
  /// regions, or ages layers so much that they are dropped.
  void Change();
  /// Makes a new batch of random fans. Some have no rays, some have rays of several legs.
  void MakeBatch();

  Stg::internal::grid::Grid& grid() { return grid_; }
  const Stg::internal::grid::Grid& grid() const { return grid_; }
  const Stg::internal::sensing::DirectionTables& tables() const { return tables_; }
  const Stg::internal::sensing::RayBatch& batch() const { return batch_; }

 private:
  struct Drawn {
    Stg::internal::grid::BodyId id;
    uint32_t tree;
    std::vector<Stg::internal::grid::CellSet> cells;
  };

  bool Chance(double probability) { return random_.Uniform() < probability; }
  uint32_t Below(uint32_t n) { return static_cast<uint32_t>(random_.Next() % n); }
  double PickHeight();
  std::vector<Stg::point_int_t> MakeOutline();
  void AddBody(const std::vector<Stg::point_int_t>& outline);
  void RemoveBody(size_t i);
  void ChangeVisibility(Drawn* drawn);
  void AddDots();
  void AddFrame();
  Stg::Pose PickOrigin();
  double PickRange();
  void AddFan();

  Stg::RandomStream random_;
  Stg::internal::grid::Grid grid_;
  Stg::internal::sensing::DirectionTables tables_;
  Stg::internal::sensing::RayBatch batch_;
  int32_t centre_x_, centre_y_;
  std::vector<Drawn> bodies_;
};

/// The lists that a prefilter with `per_ray` hits per ray must return, computed by ray_next(), or
/// by a walk that examines each cell. Lists of fans with several legs stay 0.
std::vector<uint32_t> ListsByWalk(const RayScene& scene, uint32_t per_ray);
std::vector<uint32_t> ListsCellByCell(const RayScene& scene, uint32_t per_ray);

/// Describes the first difference between the lists; empty if they are equal. Words past the end of
/// a list are ignored.
std::string FirstDifference(const RayScene& scene, const std::vector<uint32_t>& expected,
                            const Stg::internal::sensing::HitLists& found);

/// Describes the first ray whose body in `found` is wrong; empty if there is none.
std::string FirstWrongBody(const RayScene& scene, const Stg::internal::sensing::HitLists& found);

}  // namespace ray_scene

#endif
