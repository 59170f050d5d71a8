// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TESTS_SUPPORT_SHIPPED_WORLDS_HH
#define STAGE_TESTS_SUPPORT_SHIPPED_WORLDS_HH

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

/// The path of a file in the source tree.
inline std::string SourceFile(const std::string& path) {
  const char* const source = std::getenv("STAGE_SOURCE_DIR");
  return (std::filesystem::path(source ? source : ".") / path).string();
}

/// The paths of all shipped worlds, and of the test worlds of the stock controllers.
inline std::vector<std::string> ShippedWorlds() {
  std::vector<std::string> files;
  for (const char* folder : {"worlds", "tests/data/controllers"})
    for (const auto& entry : std::filesystem::directory_iterator(SourceFile(folder)))
      if (entry.path().extension() == ".world") files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

#endif
