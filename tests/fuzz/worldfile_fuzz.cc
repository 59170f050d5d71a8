// SPDX-License-Identifier: GPL-2.0-or-later
//
// libFuzzer entry point: any bytes must either load as a world file or throw LoadError.
//   clang++ -fsanitize=fuzzer,address,undefined ... tests/fuzz/worldfile_fuzz.cc libstage/...
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

#include "geometry/load_error.hh"
#include "pictures/color.hh"
#include "worldfile/worldfile.hh"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  Stg::Worldfile world;
  try {
    world.Load(in);
    for (int entity = 0; entity < world.GetEntityCount() && entity < 1000; ++entity) {
      double pose[4] = {};
      world.ReadString(entity, "name", "");
      world.ReadInt(entity, "samples", 0);
      world.ReadFloat(entity, "mass", 0);
      Stg::Color().Load(&world, entity);
      world.ReadTuple(entity, "pose", 0, 4, "llla", &pose[0], &pose[1], &pose[2], &pose[3]);
      world.WriteTuple(entity, "pose", 0, 4, "llla", 1.0, 2.0, 3.0, 4.0);
    }
    world.Unused();
  } catch (const Stg::LoadError&) {
    // An error in the input, correctly reported.
  }
  return 0;
}
