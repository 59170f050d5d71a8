// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the system knows of this process and of the machine.

#ifndef STAGE_TOOLS_STAGE_PROCESS_HH
#define STAGE_TOOLS_STAGE_PROCESS_HH

#include <string>

namespace Stg::program {

/// The text after the colon of the first line of a file in /proc that begins with `key`; empty if
/// there is none.
std::string FromProc(const char* file, const std::string& key);

/// Memory of this process in MB (2^20 bytes): the most so far, and now. The latter is 0 where the
/// system does not tell.
double PeakMemoryMb();
double MemoryMb();

/// To be called first: where one of the three standard files is closed, the next file to be opened
/// would take its place, and what is printed would go there.
void KeepStandardFiles();
/// Print to standard output, and see to it that all has come out. Throw std::runtime_error if this
/// or anything that was printed before is lost.
void PrintWhole(const std::string& text);
void FlushOutput();

/// While it lives, what goes to standard output comes out at standard error.
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
