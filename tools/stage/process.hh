// SPDX-License-Identifier: GPL-2.0-or-later
//
// Properties of this process and of the machine.

#ifndef STAGE_TOOLS_STAGE_PROCESS_HH
#define STAGE_TOOLS_STAGE_PROCESS_HH

#include <string>

namespace Stg::program {

/// Returns the text after the colon in the first line of a /proc file that starts with `key`; empty
/// if there is none.
std::string FromProc(const char* file, const std::string& key);

/// Peak and current memory of this process in MB (2^20 bytes). Current memory is 0 if unknown.
double PeakMemoryMb();
double MemoryMb();

/// Call first. If a standard stream is closed, the next file to be opened would get its descriptor
/// and receive what is printed.
void ReserveStandardStreams();
/// Print to standard output and verify that everything arrived. Throw std::runtime_error if this or
/// any earlier output was lost.
void PrintWhole(const std::string& text);
void FlushOutput();

/// Redirects standard output to standard error during its lifetime.
class OutputToError {
 public:
  OutputToError();
  ~OutputToError();
  OutputToError(const OutputToError&) = delete;
  OutputToError& operator=(const OutputToError&) = delete;

 private:
  int saved_;
};

}  // namespace Stg::program

#endif
