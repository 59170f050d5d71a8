// SPDX-License-Identifier: GPL-2.0-or-later
//
// --explain: loads worlds and says what would run, what not, and what it would take.

#ifndef STAGE_TOOLS_STAGE_EXPLAIN_HH
#define STAGE_TOOLS_STAGE_EXPLAIN_HH

#include <string>
#include <vector>

#include "stage/estimate.hh"
#include "stage/options.hh"

namespace Stg::program {

/// Returns the status to exit with. Throws UsageError, std::runtime_error.
int Explain(const Options& options);

/// For people: aligned lines, about a screen for each world.
std::string ExplanationText(const Explanation& world);
/// One world's figures lie in the object itself; those of several in objects of its array "worlds".
std::string ExplanationJson(const std::vector<Explanation>& worlds, const RunOptions& options);

}  // namespace Stg::program

#endif
