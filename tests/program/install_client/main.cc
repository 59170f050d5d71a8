// SPDX-License-Identifier: GPL-2.0-or-later
//
// A program built outside the source tree. Runs a world of two robots, one with a controller of
// Stage and one with circle.cc. Prints the version, each robot's distance from its start, and the
// shared libraries in use.

#include <fstream>
#include <set>
#include <sstream>
#include <stage.hh>

namespace {

constexpr int kSteps = 20;

const char kWorld[] = R"(
resolution 0.05
interval_sim 100
model( pose [4 0 0 0] size [0.2 8 1] )
position
(
  name "wanderer"
  size [0.4 0.4 0.3]
  ctrl "wander"
  ranger( sensor( range [0 3] fov 180 samples 19 ) )
)
position( name "circler" pose [0 3 0 0] size [0.4 0.4 0.3] ctrl "circle" )
)";

void PrintWay(const Stg::Model& model, const Stg::Pose& begin) {
  const Stg::Pose end = model.GetPose();
  std::cout << model.TokenStr() << ' ' << std::hypot(end.x - begin.x, end.y - begin.y) << '\n';
}

void PrintLibraries() {
  std::set<std::string> paths;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    const size_t slash = line.find('/');
    if (slash != std::string::npos && line.find(".so", slash) != std::string::npos)
      paths.insert(line.substr(slash));
  }
  for (const std::string& path : paths) std::cout << "library " << path << '\n';
}

}  // namespace

int main(int argc, char* argv[]) {
  Stg::Init(&argc, &argv);
  Stg::World world;
  std::istringstream text(kWorld);
  if (!world.Load(text)) return 1;
  const Stg::Model* wanderer = world.GetModel("wanderer");
  const Stg::Model* circler = world.GetModel("circler");
  if (!wanderer || !circler) return 1;

  const Stg::Pose wanderer_begin = wanderer->GetPose(), circler_begin = circler->GetPose();
  for (int i = 0; i < kSteps; ++i) world.Update();
  std::cout << "version " << Stg::Version() << '\n';
  PrintWay(*wanderer, wanderer_begin);
  PrintWay(*circler, circler_begin);
  PrintLibraries();
  return 0;
}
