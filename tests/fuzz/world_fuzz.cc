// SPDX-License-Identifier: GPL-2.0-or-later
//
// libFuzzer entry point: any bytes either fail to load or give a world that steps, with contacts of
// cells and of outlines. One thread with separate rays must give the same results as two threads
// with ray batches.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

#include "fuzz/two_ways.hh"
#include "geometry/load_error.hh"
#include "stage.hh"
#include "worldfile/worldfile.hh"

namespace {

constexpr int kSteps = 12;

/// Size of a world file's content. Files beyond these limits take too long to fuzz.
class Extent {
 public:
  /// Throws LoadError.
  explicit Extent(Stg::Worldfile* file) : file_(*file) {
    cell_ = file_.ReadFloat(0, "resolution", 0.02);
    for (int entity = 1; entity < file_.GetEntityCount() && entity <= kMaxEntities; entity++)
      Add(entity);
  }
  bool IsSmall() const {
    return file_.GetEntityCount() <= kMaxEntities && cells_ < 1e5 && reach_ < 1e5 && rays_ < 3000 &&
           pixels_ < 10000 && points_ < 1000;
  }

 private:
  static constexpr int kMaxEntities = 60;

  void Add(int entity) {
    double x = 0, y = 0;
    file_.ReadTuple(entity, "size", 0, 2, "ll", &x, &y);
    cells_ += (std::fabs(x) + std::fabs(y)) / cell_;
    double wide = 0, high = 0;
    file_.ReadTuple(entity, "resolution", 0, 2, "ff", &wide, &high);
    pixels_ += std::fabs(wide * high);
    rays_ += std::fabs(file_.ReadFloat(entity, "samples", 1));
    rays_ += std::fabs(file_.ReadFloat(entity, "image", 80));
    points_ += std::fabs(file_.ReadFloat(entity, "points", 0));
    for (const char* range : {"range_max", "range", "range_min"})
      for (size_t i = 0; i < file_.TupleLength(entity, range) && i < 2; i++) {
        double metres = 0;
        file_.ReadTuple(entity, range, static_cast<unsigned>(i), 1, "l", &metres);
        reach_ += std::fabs(metres) / cell_;
      }
  }

  Stg::Worldfile& file_;
  double cell_ = 0.02;
  double cells_ = 0, reach_ = 0, rays_ = 0, pixels_ = 0, points_ = 0;
};

/// True if the text names files, which would be read or run, or is too large.
bool IsOutOfBounds(const std::string& text) {
  for (const char* word : {"ctrl", "include", "bitmap", "threads"})
    if (text.find(word) != std::string::npos) return true;
  try {
    std::istringstream in(text);
    Stg::Worldfile file;
    file.Load(in);
    return !Extent(&file).IsSmall();
  } catch (const Stg::LoadError&) {
    return false;  // an error that loading the world must find too
  }
}

struct Outcome {
  bool loaded;
  int status;
  uint64_t hash;
  bool operator==(const Outcome&) const = default;
};

Outcome Run(const std::string& text, bool plain, Stg::ContactModel contacts) {
  two_ways::Choose(plain, contacts);
  Stg::World world;
  std::istringstream in(text);
  Outcome outcome{world.Load(in), world.LoadStatus(), 0};
  two_ways::Check(outcome.loaded == (outcome.status == 0), "a failure has a status");
  if (!outcome.loaded) return outcome;
  two_ways::CheckValid(world);
  for (int i = 0; i < kSteps; i++) {
    world.Update();
    two_ways::CheckValid(world);
  }
  outcome.hash = world.StateHash();
  return outcome;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (size > 4000 || IsOutOfBounds(text)) return 0;
  for (const auto contacts : {Stg::ContactModel::kCells, Stg::ContactModel::kOutlines})
    two_ways::Check(Run(text, true, contacts) == Run(text, false, contacts),
                    "both ways come out the same");
  return 0;
}
