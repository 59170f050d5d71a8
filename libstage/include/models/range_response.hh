// SPDX-License-Identifier: GPL-2.0-or-later
//
// RangeResponse: what a proximity sensor, such as an infrared one, reports at which distance. Part
// of <stage.hh>; C++11.

#ifndef STAGE_MODELS_RANGE_RESPONSE_HH
#define STAGE_MODELS_RANGE_RESPONSE_HH

#include <vector>

#include "random/random.hh"

namespace Stg {

class Worldfile;

/// A curve of values over distances, with noise. The curve is linear between its points and
/// constant beyond the outermost ones.
class RangeResponse {
 public:
  struct Point {
    double range;  ///< metres; ascending
    double value;
  };

  RangeResponse() : noise_(0), relative_noise_(0) {}
  /// Reads the properties `response` and `response_noise` of a ranger's sensor.
  void Load(Worldfile* wf, int entity);
  /// False if the sensor has no curve.
  bool exists() const { return !points_.empty(); }
  const std::vector<Point>& points() const { return points_; }
  bool IsNoisy() const { return noise_ > 0 || relative_noise_ > 0; }
  /// Value at a distance, without noise.
  double At(double range) const;
  /// Fills in the values for these ranges, with noise. A value is at least 0 if all values of the
  /// curve are.
  void Fill(const std::vector<double>& ranges, RandomStream* random,
            std::vector<double>* values) const;

 private:
  std::vector<Point> points_;
  double noise_, relative_noise_;  // standard deviations: constant, and as a fraction of the value
};

}  // namespace Stg

#endif
