// SPDX-License-Identifier: GPL-2.0-or-later
//
// --explain: loads worlds and reports what would run, what is left out and what a step will cost.

#ifndef STAGE_TOOLS_STAGE_EXPLAIN_HH
#define STAGE_TOOLS_STAGE_EXPLAIN_HH

#include <string>
#include <vector>

#include "stage/estimate.hh"
#include "stage/options.hh"

namespace Stg::program {

/// Returns the exit status. Throws UsageError, std::runtime_error.
int Explain(const Options& options);

/// Text for people: aligned lines, about a screen per world.
std::string ExplanationText(const Explanation& world);
/// A JSON object with the values of a single world, or with an array "worlds" of several.
std::string ExplanationJson(const std::vector<Explanation>& worlds, const RunOptions& options);

}  // namespace Stg::program

#endif
