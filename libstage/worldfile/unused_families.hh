// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_UNUSED_FAMILIES_HH
#define STAGE_WORLDFILE_UNUSED_FAMILIES_HH

#include <cstddef>
#include <string>
#include <vector>

#include "worldfile/worldfile.hh"

namespace Stg::worldfile {

/// Unused properties reported in one line: their names differ only in indices, and they have the
/// same suggestion.
struct UnusedFamily {
  UnusedProperty first;  ///< in file order
  std::size_t more = 0;  ///< number of further members

  /// Says that the properties are never read, and what to use instead if known.
  std::string Message() const;
};

/// Groups the properties into families, in the order of their first members.
std::vector<UnusedFamily> GroupUnused(const std::vector<UnusedProperty>& unused);

}  // namespace Stg::worldfile

#endif
