// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a run did, as JSON: --stats.

#ifndef STAGE_TOOLS_STAGE_REPORT_HH
#define STAGE_TOOLS_STAGE_REPORT_HH

#include <optional>
#include <string>
#include <vector>

#include "stage/run.hh"

namespace Stg::program {

/// The statistics of a run: an object with a line end. One world's figures lie in the object
/// itself; those of several in objects of its array "worlds".
std::string Statistics(const std::vector<LoadedWorld>& worlds);

/// Where a report will go: a file, which is written whole or not at all, or standard output.
class ReportFile {
 public:
  /// `name`: "-" is standard output. Throws std::runtime_error if it could not be written, or holds
  /// something else than an earlier report; leaves no trace.
  explicit ReportFile(const std::string& name);
  /// Throws std::runtime_error.
  void Write(const std::string& text) const;

 private:
  std::string name_;   // as given
  std::string place_;  // empty: standard output
};

/// The file that --stats names, if it does. Throws UsageError if it could not be written.
std::optional<ReportFile> OpenReport(const Options& options);

}  // namespace Stg::program

#endif
