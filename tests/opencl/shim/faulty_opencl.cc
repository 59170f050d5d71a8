// SPDX-License-Identifier: GPL-2.0-or-later
//
// Library to preload into the program: OpenCL with a fault. Passes on all calls of the plug-in
// except one, selected by the environment:
//
//   STAGE_FAULT       CALL:NUMBER:FAULT:PROCESS, such as clFinish:3:hang:parent: the third call of
//                     clFinish in that process (child: one that was forked) goes wrong
//   STAGE_FAULT_LOG   a file; gets a line "PROCESS CALL" for each call

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <string>
#include <type_traits>

#include "real_opencl.hh"

namespace {

const pid_t g_first_process = getpid();

const char* ProcessName() { return getpid() == g_first_process ? "parent" : "child"; }

void Log(const char* call) {
  const char* const name = std::getenv("STAGE_FAULT_LOG");
  if (!name) return;
  const std::string line = std::string(ProcessName()) + " " + call + "\n";
  const int file = open(name, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (write(file, line.data(), line.size()) < 0) abort();
  close(file);
}

/// Fault of the `number`-th call with that name; empty: no fault.
std::string FaultOf(const char* call, int number) {
  const char* const wanted = std::getenv("STAGE_FAULT");
  if (!wanted) return "";
  const std::string text = wanted, begin = call + (":" + std::to_string(number)) + ":";
  const std::string end = std::string(":") + ProcessName();
  if (text.rfind(begin, 0) != 0 || text.size() < begin.size() + end.size()) return "";
  const std::size_t length = text.size() - begin.size() - end.size();
  return text.substr(begin.size() + length) == end ? text.substr(begin.size(), length) : "";
}

void* CrashHere(void*) {
  static int* volatile nowhere = nullptr;
  *nowhere = 1;  // NOLINT(clang-analyzer-core.NullDereference): as asked for
  return nullptr;
}

/// Faults that do not return; does nothing for others.
void Suffer(const std::string& fault) {
  if (fault == "abort") abort();
  if (fault == "exit") exit(1);
  if (fault == "segv") CrashHere(nullptr);
  pthread_t thread;
  if (fault == "thread") pthread_create(&thread, nullptr, CrashHere, nullptr);
  while (fault == "hang" || fault == "thread") pause();
}

void SetLastToError() {}
void SetLastToError(cl_int* error) {
  if (error) *error = CL_OUT_OF_RESOURCES;
}
template <typename First, typename... Others>
void SetLastToError(First, Others... others) {
  SetLastToError(others...);
}

template <typename Function>
struct Faulty;
template <typename Result, typename... Arguments>
struct Faulty<Result(Arguments...)> {
  static Result Call(const char* name, std::atomic<int>* calls, Arguments... arguments) {
    Log(name);
    if (const std::string fault = FaultOf(name, ++*calls); !fault.empty()) {
      Suffer(fault);
      SetLastToError(arguments...);
      if constexpr (std::is_pointer_v<Result>)
        return nullptr;
      else
        return CL_OUT_OF_RESOURCES;
    }
    static const auto next = Real<Result(Arguments...)>(name);
    return next(arguments...);
  }
};

}  // namespace

// The second function's type gives the first one's arguments, which are not repeated here.
#define FAULTY(name)                                                                \
  namespace {                                                                       \
  template <typename>                                                               \
  struct Of_##name;                                                                 \
  template <typename Result, typename... Arguments>                                 \
  struct Of_##name<Result(Arguments...)> {                                          \
    static Result Call(Arguments... arguments) {                                    \
      static std::atomic<int> calls{0};                                             \
      return Faulty<Result(Arguments...)>::Call(#name, &calls, arguments...);       \
    }                                                                               \
  };                                                                                \
  }                                                                                 \
  extern "C" {                                                                      \
  using Type_##name = decltype(name);                                               \
  __attribute__((visibility("hidden"))) Type_##name* Resolve_##name() {             \
    return Of_##name<Type_##name>::Call;                                            \
  }                                                                                 \
  __attribute__((ifunc("Resolve_" #name), visibility("default"))) Type_##name name; \
  }

FAULTY(clBuildProgram)
FAULTY(clCreateBuffer)
FAULTY(clCreateCommandQueue)
FAULTY(clCreateContext)
FAULTY(clCreateKernel)
FAULTY(clCreateProgramWithSource)
FAULTY(clEnqueueMapBuffer)
FAULTY(clEnqueueNDRangeKernel)
FAULTY(clEnqueueReadBuffer)
FAULTY(clEnqueueUnmapMemObject)
FAULTY(clEnqueueWriteBuffer)
FAULTY(clFinish)
FAULTY(clFlush)
FAULTY(clGetDeviceIDs)
FAULTY(clGetDeviceInfo)
FAULTY(clGetKernelWorkGroupInfo)
FAULTY(clGetPlatformIDs)
FAULTY(clGetPlatformInfo)
FAULTY(clGetProgramBuildInfo)
FAULTY(clGetProgramInfo)
FAULTY(clReleaseCommandQueue)
FAULTY(clReleaseContext)
FAULTY(clReleaseEvent)
FAULTY(clReleaseKernel)
FAULTY(clReleaseMemObject)
FAULTY(clReleaseProgram)
FAULTY(clRetainCommandQueue)
FAULTY(clRetainContext)
FAULTY(clRetainKernel)
FAULTY(clRetainMemObject)
FAULTY(clSetKernelArg)
FAULTY(clWaitForEvents)
