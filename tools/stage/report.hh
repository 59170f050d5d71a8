// SPDX-License-Identifier: GPL-2.0-or-later
//
// --stats: statistics of a run as JSON.

#ifndef STAGE_TOOLS_STAGE_REPORT_HH
#define STAGE_TOOLS_STAGE_REPORT_HH

#include <optional>
#include <string>
#include <vector>

#include "stage/run.hh"

namespace Stg::program {

/// Returns the statistics of a run as a JSON object with a line end. The values of a single world
/// are in the object itself, those of several in its array "worlds".
std::string Statistics(const std::vector<LoadedWorld>& worlds);

/// With --opencl: says in a few words whether the device was faster than the host's threads.
std::string DeviceUse(const RunStatistics& run, const RunOptions& options);

/// Destination of a report: standard output, or a file that is written completely or not at all.
class ReportFile {
 public:
  /// `name`: "-" is standard output. Throws std::runtime_error if it cannot be written, or exists
  /// and is not a report. Does not change the file.
  explicit ReportFile(const std::string& name);
  bool IsStandardOutput() const { return place_.empty(); }
  /// Throws std::runtime_error.
  void Write(const std::string& text) const;

 private:
  std::string name_;   // as given
  std::string place_;  // empty: standard output
};

/// Prints text on standard output, or on standard error if the report goes to standard output.
void PrintUnlessReport(const std::optional<ReportFile>& report, const std::string& text);

/// Opens the file named by --stats, if any. Throws UsageError if it cannot be written.
std::optional<ReportFile> OpenReport(const Options& options);

}  // namespace Stg::program

#endif
