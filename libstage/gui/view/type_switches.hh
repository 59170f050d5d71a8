// SPDX-License-Identifier: GPL-2.0-or-later
//
// Switches of the data filter that are offered because models of a certain type exist.

#ifndef STAGE_GUI_VIEW_TYPE_SWITCHES_HH
#define STAGE_GUI_VIEW_TYPE_SWITCHES_HH

#include <optional>
#include <string>
#include <vector>

#include "gui/view/view_options.hh"
#include "models/model.hh"

namespace Stg::view {

/// A switch of every window, or one of the type's own that ViewOptions::IsOn() queries.
struct TypeSwitch {
  TypeSwitch(Show of_all_windows)
      : show(of_all_windows) {}  // NOLINT(google-explicit-constructor): reads well in lists
  TypeSwitch(const char* menu, const char* of_window_section, bool at_first)
      : menu_name(menu), property(of_window_section), on(at_first) {}

  std::optional<Show> show;
  std::string menu_name, property;
  bool on = false;
};

struct TypeSwitches {
  bool (*is)(const Model& model);  ///< true if the model is of this type
  std::vector<TypeSwitch> switches;
};

/// Call during static initialization, while libraries are loaded.
void RegisterTypeSwitches(const TypeSwitches& switches);
/// Returns all types, ordered by the name of their first switch; independent of registration order.
const std::vector<TypeSwitches>& AllTypeSwitches();

}  // namespace Stg::view

#endif
