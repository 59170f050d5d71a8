// SPDX-License-Identifier: GPL-2.0-or-later
//
// Plug-ins that were built with other headers are refused in one line, before any of their code
// runs.

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "support/cli_testing.hh"
#include "world/plugin_stamp.hh"

namespace cli_testing {
namespace {

class PluginsTest : public CliTest {
 protected:
  static std::string Folder() {
    const char* const build = std::getenv("STAGE_BINARY_DIR");
    return std::string(build ? build : ".") + "/tests/plugins";
  }
  /// The lines of a world file that load a plug-in: as a controller, and for its model types.
  static Strings UsesOf(const std::string& plugin) {
    return {"model( ctrl \"" + plugin + "\" )", "plugins [\"" + plugin + "\"]\nmodel()"};
  }
};

TEST_F(PluginsTest, OthersThanThoseOfTheseHeadersAreRefused) {
  const std::string expected = std::string(", expected ") + STAGE_PLUGIN_STAMP + "; build it anew",
                    other = "another version of Stage: found 4.9.0 0123456789abcdef" + expected;
  const std::vector<std::pair<std::string, std::string>> plugins = {
      {"old_headers", "an older version of Stage, without a stamp" + expected},
      {"other_headers", other},
      {"mixed_headers", other}};
  for (const char* name : {"old_headers", "other_headers", "mixed_headers"})
    fs::copy(Folder() + "/" + name + ".so", Path(std::string(name) + ".so"));
  for (const auto& [name, reason] : plugins)
    for (const std::string& found : {name, "./" + name + ".so"})
      for (const std::string& use : UsesOf(found)) {
        SCOPED_TRACE(use);
        Write("w.world", "quit_time 0.3\n" + use + "\n");
        // The second one finds the plug-in as the system does.
        for (const char* variable : {"STAGEPATH", "LD_LIBRARY_PATH"}) {
          const Result r = Stage({"-g", "w.world"}, {{variable, "."}});
          EXPECT_EQ(r.status, 255);
          EXPECT_EQ(CountOf(r.err, "\n"), 1u) << r.err;
          EXPECT_TRUE(Contains(r.err, name + ".so was built for headers of " + reason)) << r.err;
          EXPECT_FALSE(Contains(r.err, "STAGEPATH")) << r.err;
          EXPECT_FALSE(fs::exists(Path("opened")));
        }
      }
}

TEST_F(PluginsTest, ThoseOfTheseHeadersAreLoaded) {
  for (const std::string& use : UsesOf(Folder() + "/mark.so")) {
    SCOPED_TRACE(use);
    fs::remove(Path("opened"));
    Write("w.world", "quit_time 0.3\n" + use + "\n");
    const Result r = Stage({"-g", "w.world"});
    EXPECT_EQ(r.status, 0) << r.err;
    EXPECT_TRUE(fs::exists(Path("opened")));
  }
}

/// The sections' names and the symbols are not needed to find a stamp.
TEST_F(PluginsTest, StrippedPluginsAreLoaded) {
  if (std::system("strip --version >out 2>&1") != 0) GTEST_SKIP() << "there is no strip";
  const std::string command =
      "strip --strip-all -o '" + Path("mark.so").string() + "' '" + Folder() + "/mark.so'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  Write("w.world", "quit_time 0.3\nmodel( ctrl \"./mark.so\" )\n");
  const Result r = Stage({"-g", "w.world"});
  EXPECT_EQ(r.status, 0) << r.err;
}

}  // namespace
}  // namespace cli_testing
