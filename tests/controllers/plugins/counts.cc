// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller that counts how often it was started: each time the file that its argument names
// grows by a byte, whoever else writes there. Of tests and benchmarks.

#include <fcntl.h>
#include <unistd.h>

#include <sstream>
#include <string>

#include "stage.hh"

extern "C" int Init(Stg::Model*, Stg::CtrlArgs* arguments) {
  std::istringstream words(arguments->worldfile);
  std::string file;
  words >> file >> file;
  const int to = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const bool written = to >= 0 && write(to, ".", 1) == 1;
  if (to >= 0) close(to);
  return written ? 0 : 1;
}
