// SPDX-License-Identifier: GPL-2.0-or-later
// libFuzzer entry point: any bytes either give a picture with outlines or throw LoadError.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "geometry/load_error.hh"
#include "pictures/picture.hh"
#include "pictures/trace.hh"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const Stg::picture::Bitmap bitmap = Stg::picture::LoadFromMemory(data, size, "fuzz");
    for (const auto& polygon : Stg::picture::Trace(bitmap)) {
      if (polygon.size() < 4) std::abort();
    }
  } catch (const Stg::LoadError&) {
  }
  return 0;
}
