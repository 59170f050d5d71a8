// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_SETTINGS_HH
#define STAGE_WORLDFILE_SETTINGS_HH

#include <string>

#include "worldfile/document.hh"

/// Values given from outside that override those in a world file: the `--set` of a run. See
/// Worldfile::Set() for their syntax.
namespace Stg::worldfile {

inline constexpr std::size_t kMaxSettings = 1000;

struct Setting {
  // "world", a type, the name of a macro, model or population, or #N for entity number N
  std::string selector;
  std::string property;  // empty: the number of `selector`
  std::string value;
};

/// Throws LoadError if the text is not a setting.
Setting ReadSetting(const std::string& text);

/// Overrides the property in all entities that match the selector, including later ones. Later
/// settings override earlier ones.
void Override(Document& document, const Setting& setting);

/// Throws LoadError for the first setting that no reader has used, with the reason.
void CheckOverridesAreRead(const Document& document);

}  // namespace Stg::worldfile

#endif
