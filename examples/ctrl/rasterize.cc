// SPDX-License-Identifier: GPL-2.0-or-later
//
// rasterize: prints the outline of a model's body as text, once. An example of Model::Rasterize().

#include <cstdint>
#include <string>
#include <vector>

#include "stage.hh"

namespace {

constexpr unsigned kWidth = 40, kHeight = 20;  // characters

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  model->DeclareNoState("rasterize");
  const Stg::Size size = model->GetGeom().size;
  std::vector<uint8_t> cells(kWidth * kHeight, 0);
  model->Rasterize(cells.data(), kWidth, kHeight, size.x / kWidth, size.y / kHeight);

  const auto tell = [](const std::string& text) {
    Stg::Tell(Stg::LogLevel::kProgress, "[Rasterize] " + text);
  };
  tell(Stg::Printable(model->TokenStr(), 80) + " in " + std::to_string(kWidth) + " by " +
       std::to_string(kHeight) + " cells:");
  for (unsigned row = kHeight; row-- > 0;) {
    std::string line;
    for (unsigned column = 0; column < kWidth; column++)
      line += cells[column + row * kWidth] ? 'O' : '.';
    tell(line);
  }
  tell("done");
  return 0;
}
