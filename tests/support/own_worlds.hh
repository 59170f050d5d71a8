// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads worlds that are independent of all others.

#ifndef STAGE_TESTS_SUPPORT_OWN_WORLDS_HH
#define STAGE_TESTS_SUPPORT_OWN_WORLDS_HH

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <sstream>
#include <string>

#include "stage.hh"

namespace Stg {

inline RunOptions OptionsOf(uint64_t seed) {
  RunOptions options;
  options.seed = seed;
  options.listed = false;
  return options;
}

inline std::unique_ptr<World> LoadFile(const std::string& file, uint64_t seed) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  EXPECT_TRUE(world->Load(file)) << file;
  return world;
}

inline std::unique_ptr<World> LoadText(const std::string& text, uint64_t seed) {
  auto world = std::make_unique<World>(OptionsOf(seed));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

}  // namespace Stg

#endif
