// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/map_commands.hh"

#include <string_view>

#include "stage/python_module.hh"

namespace Stg::program {

void BecomeMapCommand(int argc, char* argv[]) {
  const std::string_view command = argc > 1 ? argv[1] : "";
  if (command == "import" || command == "export")
    BecomePythonModule("stagesim.maps", {argv + 1, argv + argc});
}

}  // namespace Stg::program
