// SPDX-License-Identifier: GPL-2.0-or-later
//
// libFuzzer entry point: a world either restores a snapshot file or rejects it and is unchanged. A
// restored state can be saved and read again, and the earlier state can be restored afterwards.
//
// Bytes: if the first is even, the rest is a file, whose checksum is corrected. Otherwise each five
// bytes change a valid file: position (three bytes), operation (cut off, insert or write), and a
// byte.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <sstream>
#include <string>

#include "stage.hh"
#include "support/snapshot_files.hh"

namespace {

using namespace Stg;
using snapshot_files::kHead;
using snapshot_files::Signed;

const char kWorld[] = R"(
resolution 0.05
position( name "r" joules 100 alwayson 1 velocity [0.4 0 0 20] fiducial_return 1
  ranger( alwayson 1 sensor( range [0 3] fov 180 samples 7 noise [0.01 0.01 1] ) )
  gripper( alwayson 1 autosnatch 1 ) blinkenlight( period 200 intensity 1 )
  bumper( alwayson 1 bcount 1 ) fiducial( alwayson 1 range_max 4 )
  blobfinder( alwayson 1 image [4 4] range 3 ) camera( alwayson 1 resolution [4 3] )
  actuator( alwayson 1 max_position 2 ) wifi( alwayson 1 model "simple" ) lightindicator()
  light() lightsensor( alwayson 1 noise [0.1 0.1] ) )
model( name "disc" size [0.2 0.2 0.2] pose [0.6 0.1 0 0] gripper_return 1 fiducial_return 2 )
model( name "wall" size [0.2 4 1] pose [2 0 0 0] )
)";

std::string FileOf(const Snapshot& snapshot) {
  std::ostringstream out;
  snapshot.Write(out);
  return out.str();
}

struct Subject {
  World world;
  Snapshot good;
  std::string file;
  std::uint64_t hash = 0;

  static RunOptions Options() {
    RunOptions options;
    options.listed = false;
    return options;
  }
  Subject() : world(Options()) {
    std::istringstream content(kWorld);
    if (!world.Load(content)) std::abort();
    for (int i = 0; i < 5; i++) world.Update();
    world.Take(&good);
    file = FileOf(good);
    hash = world.StateHash();
  }
};

std::string Changed(std::string file, const std::uint8_t* data, std::size_t size) {
  for (; size >= 5 && file.size() > kHead; data += 5, size -= 5) {
    const std::size_t place =
        kHead +
        (data[0] | std::size_t{data[1]} << 8 | std::size_t{data[2]} << 16) % (file.size() - kHead);
    const char byte = static_cast<char>(data[4]);
    if (data[3] == 0)
      file.resize(place);
    else if (data[3] == 1)
      file.insert(place, 1, byte);
    else
      file[place] = byte;
  }
  return file;
}

/// Returns false if the step failed because a size exceeds the memory, which is allowed.
bool Step(World* world) {
  try {
    world->Update();
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

/// Aborts if the parts of the world do not agree.
void CheckValid(const World& world) {
  const std::string fault = world.Validate();
  if (fault.empty()) return;
  std::fprintf(stderr, "found %s\n", fault.c_str());
  std::abort();
}

/// Aborts unless the world's state is the same after saving and restoring.
void CheckReadsBack(World* world) {
  Snapshot saved, read, again;
  if (!world->Take(&saved)) std::abort();
  std::istringstream in(FileOf(saved));
  if (!read.Read(in) || !world->Restore(read) || !world->Take(&again)) std::abort();
  if (again.hash() != saved.hash()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static auto& subject = *[] {
    Init(nullptr, nullptr);
    SetLogSink([](LogLevel, const std::string&) {});
    return new Subject;
  }();
  const bool is_file = data[0] % 2 == 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string file = Signed(is_file ? bytes : Changed(subject.file, data + 1, size - 1));
  Snapshot snapshot;
  std::istringstream in(file);
  if (snapshot.Read(in) && subject.world.Restore(snapshot)) {
    CheckValid(subject.world);
    CheckReadsBack(&subject.world);
    if (Step(&subject.world)) CheckReadsBack(&subject.world);
    CheckValid(subject.world);
    if (!subject.world.Restore(subject.good)) std::abort();
  }
  CheckValid(subject.world);
  if (subject.world.StateHash() != subject.hash) std::abort();
  return 0;
}
