// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_WORLDFILE_TESTING_HH
#define STAGE_TESTS_WORLDFILE_TESTING_HH

#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "geometry/load_error.hh"
#include "worldfile/worldfile.hh"

/// Helpers for tests of world files.
namespace Stg {

inline void LoadText(Worldfile& wf, const std::string& text) {
  std::istringstream in(text);
  wf.Load(in, "t.world");
}

// The error of loading a text; empty if it loads.
inline std::string ErrorOf(const std::string& text) {
  Worldfile wf;
  try {
    LoadText(wf, text);
  } catch (const LoadError& error) {
    EXPECT_EQ(error.exit_status(), 1);
    EXPECT_EQ(wf.GetEntityCount(), 1);
    return error.what();
  }
  return "";
}

inline std::string Tree(Worldfile& wf) {
  std::string tree;
  for (int i = 1; i < wf.GetEntityCount(); ++i) {
    tree += (i > 1 ? " " : "") + std::string(wf.GetEntityType(i)) + ":" +
            std::to_string(wf.GetEntityParent(i));
  }
  return tree;
}

inline std::string TreeOf(const std::string& text) {
  Worldfile wf;
  LoadText(wf, text);
  return Tree(wf);
}

#define EXPECT_ERROR(text, start, part)                      \
  do {                                                       \
    const std::string error = ErrorOf(text);                 \
    EXPECT_EQ(error.rfind(start, 0), 0U) << error;           \
    EXPECT_NE(error.find(part), std::string::npos) << error; \
    EXPECT_EQ(error.find('\n'), std::string::npos) << error; \
  } while (false)

}  // namespace Stg

#endif
