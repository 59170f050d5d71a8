// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_SETTINGS_HH
#define STAGE_WORLDFILE_SETTINGS_HH

#include <string>

#include "worldfile/document.hh"

/// Values that are given from outside a world file, in place of those that are written in it: the
/// `--set` of a run. See Worldfile::Set() for what they look like.
namespace Stg::worldfile {

inline constexpr std::size_t kMaxSettings = 1000;

struct Setting {
  std::string selector;  // "world", a type, the name of a macro, of a model or of a population
  std::string property;  // empty: how many there are of `selector`
  std::string value;
};

/// Throws LoadError if it is none.
Setting ReadSetting(const std::string& text);

/// From now on that property has that value in all entities that the selector names, also in those
/// that come later. Later settings win over earlier ones.
void Override(Document& document, const Setting& setting);

/// Throws LoadError for the first one that nobody has read, and says why.
void CheckOverridesAreRead(const Document& document);

}  // namespace Stg::worldfile

#endif
