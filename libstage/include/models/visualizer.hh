// SPDX-License-Identifier: GPL-2.0-or-later
//
// Visualizers: drawings of clients and models over a model in a window. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_VISUALIZER_HH
#define STAGE_MODELS_VISUALIZER_HH

#include <stddef.h>

#include <string>
#include <vector>

#include "pictures/color.hh"

namespace Stg {

class Camera;
class Model;

/// Attach it with Model::AddVisualizer().
class Visualizer {
 public:
  /// Names of the option that switches it: in the menu, and in the window section of world files.
  Visualizer(const std::string& menu_name, const std::string& worldfile_name)
      : menu_name_(menu_name), worldfile_name_(worldfile_name) {}
  virtual ~Visualizer(void) {}

  /// Called for each picture while the option is on and the model has subscribers, with the model's
  /// frame as drawing frame.
  virtual void Visualize(Model* mod, Camera* cam) = 0;

  const std::string& GetMenuName() { return menu_name_; }
  const std::string& GetWorldfileName() { return worldfile_name_; }

 private:
  const std::string menu_name_, worldfile_name_;
};

/// A chart of the latest values of a quantity, in a rectangle of the screen (pixels).
class StripPlotVis : public Visualizer {
 public:
  /// `len` is the number of values shown. x and y are relative to the lower left corner of the
  /// picture.
  StripPlotVis(float x, float y, float w, float h, size_t len, Color fgcolor, Color bgcolor,
               const char* name, const char* wfname);
  virtual ~StripPlotVis() {}

  void AppendValue(float value);
  /// Draws nothing; renderers use the following functions.
  void Visualize(Model* mod, Camera* cam) override;

  float x() const { return x_; }
  float y() const { return y_; }
  float width() const { return width_; }
  float height() const { return height_; }
  const Color& color() const { return color_; }
  const Color& background() const { return background_; }

  /// The values, oldest first.
  std::vector<float> Values() const;
  /// Extremes of all values ever appended; 0 before the first.
  float Least() const { return least_; }
  float Greatest() const { return greatest_; }

 private:
  std::vector<float> ring_;  // ring buffer: once full, next_ is the oldest value
  size_t capacity_, next_;
  float least_, greatest_;
  float x_, y_, width_, height_;
  Color color_, background_;
};

}  // namespace Stg

#endif
