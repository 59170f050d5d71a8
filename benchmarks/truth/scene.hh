// SPDX-License-Identifier: GPL-2.0-or-later
//
// What is in a world at one moment, as exact geometry: the outlines of all bodies where they are.
// Written without the library's grid and ray walk, whose results are compared with it: it takes the
// models' poses and polygons, and computes everything else itself.

#ifndef STAGE_BENCHMARKS_TRUTH_SCENE_HH
#define STAGE_BENCHMARKS_TRUTH_SCENE_HH

#include <map>
#include <vector>

#include "benchmarks/truth/box_tree.hh"
#include "stage.hh"

namespace truth {

/// Where a sensor's rays begin.
struct Viewpoint {
  const Stg::Model* finder = nullptr;  ///< rays pass its whole tree
  Point origin;
  double z = 0;  ///< of all rays
  Real heading = 0;
};

/// The point of an outline that a ray meets first.
struct Hit {
  const Stg::Model* model = nullptr;  ///< null: nothing within the range
  Real distance = 0;                  ///< metres; the range if nothing is hit
  Real incidence = 0;                 ///< between ray and outline: 0 along it, pi/2 square to it
};

class Scene {
 public:
  /// Takes all bodies as they are now. What has not changed since the last call is kept.
  void Take(const Stg::World& world);

  /// What a range sensor would find that is exact: the nearest outline of a body that is not of the
  /// finder's tree, has no negative ranger_return and whose heights contain z, ends included.
  Hit Cast(const Viewpoint& from, Real bearing, double range) const;

  /// How far the nearest such outline is, in any direction; at most `limit`.
  Real Clearance(const Viewpoint& from, Real limit) const;

 private:
  struct Edge {
    Point a, b;  // in the body's frame
    uint32_t block;
  };
  struct Shape {
    std::vector<std::vector<Stg::point_t>> points;  // to notice changes
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
    double lift;  // to be added to the heights of its blocks
    Box box;
  };

  void Add(const Stg::Model& model);
  static bool IsSame(const Shape& shape, const Stg::Model& model);
  static void Make(const Stg::Model& model, Shape* shape);
  static bool Stops(const Body& body, const Stg::Model& finder);

  std::map<uint32_t, Shape> shapes_;  // by the models' numbers
  std::vector<Body> bodies_;
  BoxTree tree_;
};

/// Where the rays of one of the ranger's sensors begin.
Viewpoint ViewpointOf(const Stg::ModelRanger& ranger, const Stg::ModelRanger::Sensor& sensor);

}  // namespace truth

#endif
