// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/open_device.hh"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "kernels_embedded.hh"
#include "libstage_cl/environment.hh"
#include "sensing/prefilter.hh"
#include "threads/wall_clock.hh"

namespace Stg::cl {

namespace {

/// Puts a log on one line and limits its length.
std::string Shortened(std::string log) {
  constexpr size_t kLongest = 400;
  std::replace(log.begin(), log.end(), '\n', ' ');
  log.erase(std::find(log.begin(), log.end(), '\0'), log.end());
  return log.size() > kLongest ? log.substr(0, kLongest) + "..." : log;
}

/// Checks what the kernels need and not every device has. Other limits of the embedded profile do
/// not matter: floats only guess, images are not used, arguments take about 100 bytes.
void CheckDevice(const ::cl::Device& device) {
  constexpr unsigned kBits = 8 * 16;  // alignment of the most aligned record
  if (device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() == CL_FALSE)
    throw sensing::PrefilterError("its driver has no compiler for the kernels");
  if (IsEmbedded(device) &&
      device.getInfo<CL_DEVICE_EXTENSIONS>().find("cles_khr_int64") == std::string::npos)
    throw sensing::PrefilterError(
        "it has the embedded profile without 64-bit integers (cles_khr_int64), which the kernels "
        "need");
  if (const unsigned bits = device.getInfo<CL_DEVICE_MEM_BASE_ADDR_ALIGN>(); bits < kBits)
    throw sensing::PrefilterError("its buffers are aligned to " + std::to_string(bits) +
                                  " bits, the kernels need " + std::to_string(kBits));
}

/// True if it has doubles whose operations are rounded as on the host.
bool HasDoubles(const ::cl::Device& device) {
  constexpr cl_device_fp_config kNeeded = CL_FP_ROUND_TO_NEAREST | CL_FP_DENORM | CL_FP_INF_NAN;
  cl_device_fp_config config = 0;
  if (device.getInfo<CL_DEVICE_EXTENSIONS>().find("cl_khr_fp64") != std::string::npos)
    device.getInfo(CL_DEVICE_DOUBLE_FP_CONFIG, &config);
  return (config & kNeeded) == kNeeded;
}

/// The parts of a program. Each needs some of those before it.
std::vector<const char*> PartsOf(Kernels kernels) {
  switch (kernels) {
    case Kernels::kWalks:
      return {kRayWalkSource, kRecordsSource, kPrefilterSource};
    case Kernels::kRanges:
      return {kRayWalkSource, kRecordsSource,   kPrefilterSource, kRowRecordsSource,
              kRowMathSource, kRowRangesSource, kRangesSource};
    case Kernels::kRows:
      return {kRayWalkSource,      kRecordsSource,    kRowRecordsSource,    kRowMathSource,
              kRowVectorSource,    kRowAccessSource,  kRowDriveSource,      kRowOdometrySource,
              kRowMoveSource,      kRowRangesSource,  kRowWallsSource,      kRowExactSource,
              kRowRaysSource,      kRowControlSource, kRowPedestrianSource, kRowOrcaSource,
              kRowBehaviourSource, kRowDrivenSource,  kRowCrowdSource,      kRowOutlinesSource,
              kRowStepSource,      kRowArraysSource,  kRowKernelsSource};
    case Kernels::kSmallIslands:
    case Kernels::kLargeIslands:
      break;
  }
  return {kRayWalkSource,   kRowRecordsSource, kRowMathSource,       kRowVectorSource,
          kRowAccessSource, kRowCrowdSource,   kRowSeparationSource, kRowSafePartSource,
          kRowIslandSource, kRowForcesSource,  kRowJointSource,      kRowSolveSource,
          kIslandsSource};
}

std::string SourceOf(Kernels kernels) {
  std::string source = kernels == Kernels::kLargeIslands ? "#define ROW_SOLVES_LARGE\n" : "";
  for (const char* const part : PartsOf(kernels)) source += std::string(part) + "\n";
  return source;
}

std::string LogOf(const ::cl::Program& program, const ::cl::Device& device) {
  try {
    return Shortened(program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device));
  } catch (const ::cl::Error&) {
    return "no log";
  }
}

}  // namespace

::cl::Program OpenDevice::Compile(Kernels kernels) const {
  const std::string options = "-cl-std=CL1.1 " + FromEnvironment("STAGE_CL_OPTIONS");
  ::cl::Program made(context, SourceOf(kernels));
  try {
    made.build(std::vector<::cl::Device>{found.device}, options.c_str());
  } catch (const ::cl::Error& error) {
    throw sensing::PrefilterError("its compiler rejects the kernels (error " +
                                  std::to_string(error.err()) + "): " + LogOf(made, found.device));
  }
  return made;
}

OpenDevice::OpenDevice(const FoundDevice& device, std::unique_ptr<DriverWatch> watch_,
                       Kernels kernels)
    : watch(std::move(watch_)), found(device) {
  calls::SetDriver(found.platform);
  CheckDevice(found.device);
  const bool has_doubles = HasDoubles(found.device);
  if (kernels == Kernels::kRows && !has_doubles)
    throw sensing::PrefilterError("it has no doubles (cl_khr_fp64), which steps of rows need");
  context = ::cl::Context(found.device);
  const double start = threads::WallClock();
  if (kernels == Kernels::kRanges && has_doubles) {
    try {
      program = Compile(Kernels::kRanges);
      finds_ranges = true;
    } catch (const sensing::PrefilterError&) {  // the device gives hit lists
    }
  }
  if (program() == nullptr)
    program = Compile(kernels == Kernels::kRanges ? Kernels::kWalks : kernels);
  compile_seconds = threads::WallClock() - start;
}

}  // namespace Stg::cl
