// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exact geometry of a world at one moment: the outlines of all bodies. It is independent of the
// library's grid and ray walk, whose results are compared with it: it takes only poses and polygons
// of models and computes everything else itself.

#ifndef STAGE_BENCHMARKS_TRUTH_SCENE_HH
#define STAGE_BENCHMARKS_TRUTH_SCENE_HH

#include <map>
#include <vector>

#include "benchmarks/truth/box_tree.hh"
#include "stage.hh"

namespace truth {

/// Start of a sensor's rays.
struct Viewpoint {
  const Stg::Model* finder = nullptr;  ///< rays pass through its whole tree
  Point origin;
  double z = 0;  ///< height of all rays
  Real heading = 0;
};

/// The first point of an outline that a ray meets.
struct Hit {
  const Stg::Model* model = nullptr;  ///< null: nothing within the range
  Real distance = 0;                  ///< metres; the range if nothing is hit
  Real incidence = 0;                 ///< angle between ray and outline: 0 along it, pi/2
                                      ///< perpendicular
};

class Scene {
 public:
  /// Copies all bodies at their current poses; unchanged ones are kept from the last call.
  void Take(const Stg::World& world);

  /// The reading of an exact range sensor: the nearest outline of a body outside the finder's tree
  /// that has no negative ranger_return and whose heights contain z, including the ends.
  Hit Cast(const Viewpoint& from, Real bearing, double range) const;

  /// Distance to the nearest such outline in any direction; at most `limit`.
  Real Clearance(const Viewpoint& from, Real limit) const;

 private:
  struct Edge {
    Point a, b;  // in the body's frame
    uint32_t block;
  };
  struct Shape {
    std::vector<std::vector<Stg::point_t>> points;  // detects changes
    std::vector<Stg::Bounds> heights;
    std::vector<Edge> edges;
    Box box;
    BoxTree tree;
  };
  struct Body {
    const Stg::Model* model;
    const Shape* shape;
    Point at;  // of its frame
    Real cosine, sine;
    double lift;  // added to the heights of its blocks
    Box box;
  };

  void Add(const Stg::Model& model);
  static bool IsSame(const Shape& shape, const Stg::Model& model);
  static void Make(const Stg::Model& model, Shape* shape);
  static bool Stops(const Body& body, const Stg::Model& finder);

  std::map<uint32_t, Shape> shapes_;  // by model id
  std::vector<Body> bodies_;
  BoxTree tree_;
};

/// Start of the rays of one of the ranger's sensors.
Viewpoint ViewpointOf(const Stg::ModelRanger& ranger, const Stg::ModelRanger::Sensor& sensor);

}  // namespace truth

#endif
