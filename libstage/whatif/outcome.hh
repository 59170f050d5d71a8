// SPDX-License-Identifier: GPL-2.0-or-later
//
// Comparison of the outcomes of two candidates.

#ifndef STAGE_WHATIF_OUTCOME_HH
#define STAGE_WHATIF_OUTCOME_HH

namespace Stg {

struct Outcome;
struct Preference;

namespace whatif {

/// True if `best` is better than `other` by `margin` at least, which may be negative, as far as
/// their samples can tell. See ConsequenceEngine::Options::errors.
bool IsToldApart(const Outcome& best, const Outcome& other, const Preference& preference,
                 double errors, double margin);

}  // namespace whatif

}  // namespace Stg

#endif
