// SPDX-License-Identifier: GPL-2.0-or-later
//
// The logo of Stage 5: a robot that scans the floor in front of it, and the name.

#ifndef STAGE_GUI_WINDOW_LOGO_HH
#define STAGE_GUI_WINDOW_LOGO_HH

#include <FL/Fl_Widget.H>

#include <string>

namespace Stg::internal::window {

class Logo : public Fl_Widget {
 public:
  static constexpr int kWidth = 264, kHeight = 82;

  Logo(int x, int y, std::string name);
  void draw() override;

 private:
  const std::string name_;
};

}  // namespace Stg::internal::window

#endif
