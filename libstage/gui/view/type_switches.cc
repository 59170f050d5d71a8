// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/view/type_switches.hh"

#include <algorithm>

namespace Stg::view {

namespace {

/// A local static: registrations run in unspecified order during static initialization.
std::vector<TypeSwitches>& All() {
  static std::vector<TypeSwitches> all;
  return all;
}

const std::string& NameOf(const TypeSwitches& type) {
  static const std::string none;
  return type.switches.empty() ? none : type.switches[0].menu_name;
}

}  // namespace

void RegisterTypeSwitches(const TypeSwitches& switches) {
  const auto place = std::ranges::upper_bound(All(), NameOf(switches), {}, NameOf);
  All().insert(place, switches);
}

const std::vector<TypeSwitches>& AllTypeSwitches() { return All(); }

}  // namespace Stg::view
