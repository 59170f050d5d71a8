// SPDX-License-Identifier: GPL-2.0-or-later
//
// Figures of a run, as JSON: --stats.

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

/// Whether the device of a run with --opencl was faster than the host's threads, in a few words.
std::string DeviceUse(const RunStatistics& run, const RunOptions& options);

/// Where a report will go: a file, which is written whole or not at all, or standard output.
class ReportFile {
 public:
  /// `name`: "-" is standard output. Throws std::runtime_error if it could not be written, or holds
  /// something else than an earlier report; leaves no trace.
  explicit ReportFile(const std::string& name);
  bool IsStandardOutput() const { return place_.empty(); }
  /// Throws std::runtime_error.
  void Write(const std::string& text) const;

 private:
  std::string name_;   // as given
  std::string place_;  // empty: standard output
};

/// Prints the text on standard output; on standard error if a report goes to the former.
void PrintBeside(const std::optional<ReportFile>& report, const std::string& text);

/// The file that --stats names, if it does. Throws UsageError if it could not be written.
std::optional<ReportFile> OpenReport(const Options& options);

}  // namespace Stg::program

#endif
