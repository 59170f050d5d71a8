// SPDX-License-Identifier: GPL-2.0-or-later

#include "run_log.hh"

#include <filesystem>
#include <mutex>
#include <set>

namespace Stg::python {

namespace {

std::mutex g_mutex;              // guards g_files
std::set<std::string>* g_files;  // absolute paths; never deleted, because logs may end at exit

}  // namespace

WrittenFile::WrittenFile(const std::string& file) {
  std::error_code ignored;
  path_ = std::filesystem::weakly_canonical(std::filesystem::absolute(file, ignored), ignored);
  const std::lock_guard lock(g_mutex);
  if (!g_files) g_files = new std::set<std::string>;
  if (g_files->insert(path_).second) return;
  throw Failure{Kind::kStage, file +
                                  ": another log is being written there, expected a file of "
                                  "its own for each log"};
}

void WrittenFile::Release() {
  const std::lock_guard lock(g_mutex);
  if (g_files) g_files->erase(path_);
}

}  // namespace Stg::python
