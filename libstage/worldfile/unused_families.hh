// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_UNUSED_FAMILIES_HH
#define STAGE_WORLDFILE_UNUSED_FAMILIES_HH

#include <cstddef>
#include <string>
#include <vector>

#include "worldfile/worldfile.hh"

namespace Stg::worldfile {

/// Unused properties that one line is enough for: their names differ in indices alone, and there is
/// the same to say about all of them.
struct UnusedFamily {
  UnusedProperty first;  ///< in file order
  std::size_t more = 0;  ///< number of the others

  /// Tells that the properties are never read, and what to use instead as far as that is known.
  std::string Message() const;
};

/// The families of the properties, in the order of their first members.
std::vector<UnusedFamily> GroupUnused(const std::vector<UnusedProperty>& unused);

}  // namespace Stg::worldfile

#endif
