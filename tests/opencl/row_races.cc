// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps two random closed worlds by the kernels of rows, for oclgrind_test.py, which finds races in
// them. It calls OpenCL directly, because the self-test of the plug-in takes too long there.
//
//   row_races PROGRAM SMALL_ISLANDS LARGE_ISLANDS CONTACTS SEED WORK_ITEMS
//
// The first three are files with the texts of the programs. Fails if a column differs from that of
// the host, or if contacts are those of outlines and nothing has touched anything.

#include <CL/cl.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "rows/device_columns.hh"
#include "rows/device_contacts.hh"
#include "rows/device_image.hh"
#include "rows/row_bridge.hh"
#include "stage.hh"
#include "support/closed_world.hh"
#include "support/random_source.hh"

namespace Stg::test {

namespace {

constexpr size_t kWorlds = 2;
constexpr uint32_t kSteps = 4;

[[noreturn]] void Fail(const std::string& what) {
  std::fprintf(stderr, "row_races: %s\n", what.c_str());
  std::exit(1);
}

void Check(cl_int error, const char* what) {
  if (error != CL_SUCCESS) Fail(std::string(what) + ": error " + std::to_string(error));
}

std::string TextOf(const char* path) {
  std::ifstream file(path);
  if (!file) Fail(std::string(path) + " can't be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

std::shared_ptr<const rows::Scene> SceneOf(bool outlines, RandomSource* random) {
  const ClosedWorldKind kind{outlines, random->OneIn(2), 4, 1.2, random->OneIn(2)};
  RunOptions options;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<World>(options);
  std::istringstream content(ClosedWorld(kind, random));
  if (!world->Load(content, "t.world")) Fail("the world can't be loaded");
  for (Model* robot : world->GetChildren()) {
    if (robot->GetModelType() != "position") continue;
    robot->Subscribe();
    for (Model* child : robot->GetChildren())
      if (child->GetModelType() == "ranger") child->Subscribe();
  }
  std::string reason;
  std::shared_ptr<const rows::Scene> scene = RowBridge::MakeScene(std::move(world), &reason);
  if (!scene) Fail(reason);
  if (reason = WhyNotOnDevice(scene); !reason.empty()) Fail(reason);
  return scene;
}

/// The first device, with the programs and buffers of rows.
class Device {
 public:
  Device(const char* const* programs, const rows::DeviceImage& image, std::vector<std::byte>* state,
         size_t work_items)
      : items_(work_items) {
    cl_platform_id platform = nullptr;
    cl_int error = CL_SUCCESS;
    Check(clGetPlatformIDs(1, &platform, nullptr), "platforms");
    Check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &device_, nullptr), "devices");
    context_ = clCreateContext(nullptr, 1, &device_, nullptr, nullptr, &error);
    Check(error, "a context");
    queue_ = clCreateCommandQueue(context_, device_, 0, &error);
    Check(error, "a queue");
    std::vector<std::byte> scratch(image.scratch_bytes);
    buffers_ = {BufferOf(image.words.size() * sizeof(uint64_t), image.words.data()),
                BufferOf(state->size(), state->data()), BufferOf(scratch.size(), scratch.data())};
    for (size_t i = 0; i < programs_.size(); i++) programs_[i] = Compile(programs[i]);
  }
  void StepCells() {
    const cl_uint first = 0, is_list = 0, steps = kSteps, unseen = 0;
    Set("step_rows", 0,
        {&first, &buffers_[0], &is_list, &buffers_[0], &buffers_[1], &buffers_[2], &steps,
         &unseen});
    Run({items_, kWorlds});
  }
  void StepOutlines() {
    const cl_uint first = 0, is_list = 0, unseen = 0;
    for (uint32_t step = 0; step < kSteps; step++) {
      Set("begin_outlines", 0,
          {&first, &buffers_[0], &is_list, &buffers_[0], &buffers_[1], &buffers_[2], &unseen});
      Run({items_, kWorlds});
      SolveIslands(1, ROW_SMALL_KINDS);
      SolveIslands(1, 1u << ROW_SLOW);
      SolveIslands(2, 1u << ROW_LARGE);
      Set("end_outlines", 0,
          {&first, &buffers_[0], &is_list, &buffers_[0], &buffers_[1], &buffers_[2]});
      Run({items_, kWorlds});
    }
  }
  void ReadState(std::vector<std::byte>* state) {
    Check(clEnqueueReadBuffer(queue_, buffers_[1], CL_TRUE, 0, state->size(), state->data(), 0,
                              nullptr, nullptr),
          "the state");
  }

 private:
  using Size = std::array<size_t, 2>;

  cl_mem BufferOf(size_t bytes, const void* from) {
    cl_int error = CL_SUCCESS;
    const cl_mem buffer =
        clCreateBuffer(context_, CL_MEM_COPY_HOST_PTR, bytes, const_cast<void*>(from), &error);
    Check(error, "a buffer");
    return buffer;
  }
  cl_program Compile(const char* path) {
    const std::string text = TextOf(path);
    const char* source = text.c_str();
    cl_int error = CL_SUCCESS;
    const cl_program program = clCreateProgramWithSource(context_, 1, &source, nullptr, &error);
    Check(error, path);
    // Oclgrind takes minutes to optimize what it then interprets.
    Check(clBuildProgram(program, 1, &device_, "-cl-std=CL1.1 -cl-opt-disable", nullptr, nullptr),
          path);
    return program;
  }
  /// Chooses a kernel. Arguments are buffers or numbers of 4 bytes.
  void Set(const char* name, size_t program, std::initializer_list<const void*> arguments) {
    cl_int error = CL_SUCCESS;
    kernel_ = clCreateKernel(programs_[program], name, &error);
    Check(error, name);
    cl_uint index = 0;
    for (const void* argument : arguments) {
      const bool is_buffer = argument >= buffers_.data() && argument < buffers_.data() + 3;
      Check(
          clSetKernelArg(kernel_, index++, is_buffer ? sizeof(cl_mem) : sizeof(cl_uint), argument),
          name);
    }
  }
  void SolveIslands(size_t program, cl_uint kinds) {
    const cl_uint items = 8;
    Set("solve_islands", program, {&buffers_[0], &buffers_[1], &buffers_[2], &items, &kinds});
    Run({items, 1}, {items / 2, 1});
  }
  void Run(const Size& all) { Run(all, all); }
  void Run(const Size& all, const Size& group) {
    Check(clEnqueueNDRangeKernel(queue_, kernel_, 2, nullptr, all.data(), group.data(), 0, nullptr,
                                 nullptr),
          "a kernel");
    Check(clFinish(queue_), "a kernel");
  }

  const size_t items_;
  cl_device_id device_ = nullptr;
  cl_context context_ = nullptr;
  cl_command_queue queue_ = nullptr;
  std::array<cl_program, 3> programs_{};
  std::array<cl_mem, 3> buffers_{};  // the image, the state, scratch memory
  cl_kernel kernel_ = nullptr;
};

int RunRaces(int argc, char** argv) {
  if (argc != 7) Fail("expected PROGRAM SMALL_ISLANDS LARGE_ISLANDS CONTACTS SEED WORK_ITEMS");
  const bool outlines = std::strcmp(argv[4], "outlines") == 0;
  RandomSource random(std::strtoull(argv[5], nullptr, 10));
  Init(&argc, &argv);
  const auto scene = SceneOf(outlines, &random);
  const std::vector<uint64_t> seeds = {1, 2};
  rows::Rows host(scene, seeds);
  for (auto& command : host.columns.command)
    command = {random.Real(-1, 1), random.Real(-1, 1), random.Real(-2, 2)};
  for (auto& mode : host.columns.mode) mode = ROW_VELOCITY_MODE;

  const auto image = MakeDeviceImage(scene, kWorlds, rows::kContactBytes);
  std::vector<std::byte> state(image.state_bytes);
  ForEachDeviceColumn(&host.columns, [&](int id, const auto* column) {
    if (!column->empty())
      rows::ToDevice(column->data(), column->size(), state.data() + image.scene().columns[id]);
  });
  Device device(argv + 1, image, &state, std::strtoull(argv[6], nullptr, 10));
  outlines ? device.StepOutlines() : device.StepCells();
  device.ReadState(&state);

  const auto scratch = host.MakeScratch();
  for (size_t i = 0; i < kWorlds; i++) host.Step(i, kSteps, scratch.get());
  size_t hindered = 0;
  for (const uint8_t is_hindered : host.columns.hindered) hindered += is_hindered;
  if (outlines && hindered == 0) Fail("nothing touches anything");
  ForEachDeviceColumn(&host.columns, [&](int id, const auto* column) {
    using T = typename std::decay_t<decltype(*column)>::value_type;
    std::vector<std::byte> bytes(column->size() * rows::kSizeOnDevice<T>);
    rows::ToDevice(column->data(), column->size(), bytes.data());
    if (!bytes.empty() &&
        std::memcmp(bytes.data(), state.data() + image.scene().columns[id], bytes.size()) != 0)
      Fail("column " + std::to_string(id) + " differs from that of the host");
  });
  std::printf("%zu hindered\n", hindered);
  return 0;
}

}  // namespace

}  // namespace Stg::test

int main(int argc, char** argv) { return Stg::test::RunRaces(argc, argv); }
