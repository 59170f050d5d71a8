// SPDX-License-Identifier: GPL-2.0-or-later
//
// The switches of the data filter that the models of a type are a reason for.

#ifndef STAGE_GUI_VIEW_TYPE_SWITCHES_HH
#define STAGE_GUI_VIEW_TYPE_SWITCHES_HH

#include <optional>
#include <string>
#include <vector>

#include "gui/view/view_options.hh"
#include "models/model.hh"

namespace Stg::view {

/// One that every window has, or one of the type's own, asked for by ViewOptions::IsOn().
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
  bool (*is)(const Model& model);  ///< of the type
  std::vector<TypeSwitch> switches;
};

/// To be called while libraries are loaded.
void RegisterTypeSwitches(const TypeSwitches& switches);
/// In the order of their first switches' names, whatever the order of registration.
const std::vector<TypeSwitches>& AllTypeSwitches();

}  // namespace Stg::view

#endif
