// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/visualizer.hh"

#include <algorithm>

namespace Stg {

StripPlotVis::StripPlotVis(float x, float y, float w, float h, size_t len, Color fgcolor,
                           Color bgcolor, const char* name, const char* wfname)
    : Visualizer(name, wfname),
      capacity_(len),
      next_(0),
      least_(0),
      greatest_(0),
      x_(x),
      y_(y),
      width_(w),
      height_(h),
      color_(fgcolor),
      background_(bgcolor) {}

void StripPlotVis::AppendValue(float value) {
  if (capacity_ == 0) return;
  least_ = ring_.empty() ? value : std::min(least_, value);
  greatest_ = ring_.empty() ? value : std::max(greatest_, value);
  if (ring_.size() < capacity_) {
    ring_.push_back(value);
    return;
  }
  ring_[next_] = value;
  next_ = (next_ + 1) % capacity_;
}

std::vector<float> StripPlotVis::Values() const {
  std::vector<float> values(ring_);
  std::rotate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(next_), values.end());
  return values;
}

void StripPlotVis::Visualize(Model*, Camera*) {}

}  // namespace Stg
