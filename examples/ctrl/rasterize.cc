// SPDX-License-Identifier: GPL-2.0-or-later
//
// rasterize: prints the outline of a model's body in characters, once. Shows how to use
// Model::Rasterize().

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "stage.hh"

namespace {

constexpr unsigned kWidth = 40, kHeight = 20;  // characters

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  const Stg::Size size = model->GetGeom().size;
  std::vector<uint8_t> cells(kWidth * kHeight, 0);
  model->Rasterize(cells.data(), kWidth, kHeight, size.x / kWidth, size.y / kHeight);

  std::printf("[Rasterize] %s in %u by %u cells:\n", Stg::Printable(model->TokenStr(), 80).c_str(),
              kWidth, kHeight);
  for (unsigned row = kHeight; row-- > 0;) {
    std::string line;
    for (unsigned column = 0; column < kWidth; column++)
      line += cells[column + row * kWidth] ? 'O' : '.';
    std::printf("[Rasterize] %s\n", line.c_str());
  }
  std::printf("[Rasterize] done\n");
  return 0;
}
