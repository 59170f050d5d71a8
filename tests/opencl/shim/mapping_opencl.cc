// SPDX-License-Identifier: GPL-2.0-or-later
//
// Library to preload into the program: OpenCL whose mapped ranges are as strict as the standard
// allows. Each map returns new memory at another address, with arbitrary contents unless mapped for
// reading. Accesses before the map, after the unmap or beyond the end, and writes to a range mapped
// for reading crash the program. Other errors make the call fail and are logged:
//
//   STAGE_MAPPING_LOG     a file; gets "wrong: TEXT", and when the first process ends "mapped N"
//                         and "transferred N", both in bytes
//   STAGE_MAPPING_FAULT   FAULT:NUMBER, to test the checks: in the first process, the NUMBER-th map
//                         (early, again) or unmap (kept, twice), or all waits from that one on
//                         (unseen), behave as if the caller had made an error

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <iterator>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "real_opencl.hh"

namespace {

constexpr std::size_t kLine = 64;  // cache line, bytes; ranges consist of whole lines

struct Range {
  std::size_t offset, bytes;
  cl_map_flags flags;
  void* real;          // the driver's mapping
  char* pages;         // end where the caller's range ends
  std::size_t length;  // of the pages; a protected page follows
  cl_event event;      // completion of the map; null: blocking map
  char* data() const { return pages + (length - bytes); }
  int rights() const { return flags & CL_MAP_WRITE ? PROT_READ | PROT_WRITE : PROT_READ; }
};

struct Buffer {
  std::size_t size = 0;
  cl_mem_flags flags = 0;
  std::vector<Range> ranges{};  // currently mapped
};

struct State {
  std::mutex mutex;
  std::map<cl_mem, Buffer> buffers;
  std::map<std::pair<cl_kernel, cl_uint>, cl_mem> arguments;
  std::deque<Range> old;  // kept for a while to catch late accesses
  uint64_t mapped = 0, transferred = 0;
  std::map<std::string, int> calls;
};

// Never deleted, as drivers are called until the process ends.
State& The() {
  static State* const state = new State;
  return *state;
}

const pid_t g_first_process = getpid();

void Log(const std::string& line) {
  const char* const name = std::getenv("STAGE_MAPPING_LOG");
  if (!name) return;
  const std::string text = line + "\n";
  const int file = open(name, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  if (write(file, text.data(), text.size()) < 0) abort();
  close(file);
}

__attribute__((destructor)) void LogSums() {
  if (getpid() != g_first_process) return;
  Log("mapped " + std::to_string(The().mapped));
  Log("transferred " + std::to_string(The().transferred));
}

/// Returns the condition; logs an error if it is false.
bool Expect(bool condition, const std::string& otherwise) {
  if (!condition) Log("wrong: " + otherwise);
  return condition;
}

/// Returns true if the requested fault is due at this call.
bool FaultAt(const std::string& fault, bool from_then_on = false) {
  const char* const wanted = std::getenv("STAGE_MAPPING_FAULT");
  if (!wanted || getpid() != g_first_process) return false;
  const std::string text = wanted;
  if (text.rfind(fault + ":", 0) != 0) return false;
  const int call = ++The().calls[fault], number = std::atoi(text.c_str() + fault.size() + 1);
  return call == number || (from_then_on && call > number);
}

#define REAL(name) Real<decltype(name)>(#name)

// ---- ranges -------------------------------------------------------------------------------------

void Protect(const Range& range, int rights) {
  if (mprotect(range.pages, range.length, rights) != 0) abort();
}

Range MakeRange(std::size_t offset, std::size_t bytes, cl_map_flags flags, void* real) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t length = (bytes + page - 1) / page * page;
  void* const pages =
      mmap(nullptr, length + page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (pages == MAP_FAILED) abort();
  Range range{offset, bytes, flags, real, static_cast<char*>(pages), length, nullptr};
  Protect(range, PROT_READ | PROT_WRITE);
  if (flags & CL_MAP_READ)
    std::memcpy(range.data(), real, bytes);
  else
    std::memset(range.data(), 0xa5, bytes);
  return range;
}

/// Copies the caller's data to the driver's mapping and protects the range.
void Close(const Range& range) {
  constexpr std::size_t kKept = 256;
  Protect(range, PROT_READ | PROT_WRITE);
  if (range.flags & CL_MAP_WRITE) std::memcpy(range.real, range.data(), range.bytes);
  Protect(range, PROT_NONE);
  madvise(range.pages, range.length, MADV_DONTNEED);
  std::deque<Range>& old = The().old;
  old.push_back(range);
  if (old.size() <= kKept) return;
  munmap(old.front().pages, old.front().length + static_cast<std::size_t>(sysconf(_SC_PAGESIZE)));
  old.pop_front();
}

/// Makes ranges accessible after a wait: all, or those of `events`.
void Open(const std::vector<cl_event>* events) {
  for (auto& [memory, buffer] : The().buffers)
    for (Range& range : buffer.ranges) {
      if (!range.event) continue;
      if (events && std::count(events->begin(), events->end(), range.event) == 0) continue;
      Protect(range, range.rights());
      range.event = nullptr;
    }
}

bool MayBeMapped(const Buffer& buffer, cl_map_flags flags, std::size_t offset, std::size_t bytes) {
  const bool overlaps =
      std::any_of(buffer.ranges.begin(), buffer.ranges.end(), [&](const Range& other) {
        return ((flags | other.flags) & CL_MAP_WRITE) && offset < other.offset + other.bytes &&
               other.offset < offset + bytes;
      });
  const bool good[] = {
      Expect(!overlaps, "mapped where it is mapped for writing already"),
      Expect(buffer.flags & CL_MEM_ALLOC_HOST_PTR, "mapped without CL_MEM_ALLOC_HOST_PTR"),
      Expect(offset % kLine == 0 && bytes % kLine == 0, "mapped in parts of cache lines"),
      Expect(offset + bytes <= buffer.size, "mapped beyond its end")};
  return std::find(std::begin(good), std::end(good), false) == std::end(good);
}

bool MayBeTransferred(cl_mem memory, std::size_t bytes) {
  The().transferred += bytes;
  return Expect(The().buffers[memory].ranges.empty(), "a transfer of what is mapped");
}

}  // namespace

// ---- replaced functions of OpenCL ---------------------------------------------------------------

STAGE_SHIM_CALL cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, std::size_t size,
                                      void* host, cl_int* error) {
  const std::lock_guard lock(The().mutex);
  Expect(size % kLine == 0, "a buffer with a part of a cache line");
  Expect((flags & (CL_MEM_USE_HOST_PTR | CL_MEM_COPY_HOST_PTR)) == 0, "a buffer that is copied");
  const cl_mem memory = REAL(clCreateBuffer)(context, flags, size, host, error);
  Buffer& buffer = The().buffers[memory];  // may be left from a deleted buffer at that address
  Expect(buffer.ranges.empty(), "a buffer that was deleted while it was mapped");
  buffer = {size, flags};
  return memory;
}

STAGE_SHIM_CALL cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, std::size_t size,
                                      const void* value) {
  const std::lock_guard lock(The().mutex);
  cl_mem memory = nullptr;
  if (size == sizeof memory && value) std::memcpy(&memory, value, size);
  The().arguments[{kernel, index}] = The().buffers.count(memory) ? memory : nullptr;
  return REAL(clSetKernelArg)(kernel, index, size, value);
}

STAGE_SHIM_CALL cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel,
                                              cl_uint dimensions, const std::size_t* offset,
                                              const std::size_t* global, const std::size_t* local,
                                              cl_uint count, const cl_event* wait,
                                              cl_event* event) {
  const std::lock_guard lock(The().mutex);
  for (const auto& [place, memory] : The().arguments)
    if (place.first == kernel && memory &&
        !Expect(The().buffers[memory].ranges.empty(),
                "a kernel with a mapped argument " + std::to_string(place.second)))
      return CL_INVALID_OPERATION;
  return REAL(clEnqueueNDRangeKernel)(queue, kernel, dimensions, offset, global, local, count, wait,
                                      event);
}

STAGE_SHIM_CALL void* clEnqueueMapBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking,
                                         cl_map_flags flags, std::size_t offset, std::size_t bytes,
                                         cl_uint count, const cl_event* wait, cl_event* event,
                                         cl_int* error) {
  const bool early = FaultAt("early"), again = FaultAt("again");
  if (again)
    clEnqueueMapBuffer(queue, memory, CL_TRUE, CL_MAP_WRITE, offset, bytes, 0, nullptr, nullptr,
                       nullptr);
  std::unique_lock lock(The().mutex);
  Buffer& buffer = The().buffers[memory];
  if (!MayBeMapped(buffer, flags, offset, bytes)) {
    if (error) *error = CL_INVALID_OPERATION;
    return nullptr;
  }
  void* const real = REAL(clEnqueueMapBuffer)(queue, memory, CL_TRUE, flags, offset, bytes, count,
                                              wait, event, error);
  if (!real) return nullptr;
  Range range = MakeRange(offset, bytes, flags, real);
  range.event = !blocking && event ? *event : nullptr;
  Protect(range, range.event ? PROT_NONE : range.rights());
  buffer.ranges.push_back(range);
  The().mapped += bytes;
  lock.unlock();
  if (early) clEnqueueUnmapMemObject(queue, memory, range.data(), 0, nullptr, nullptr);
  return range.data();
}

STAGE_SHIM_CALL cl_int clEnqueueUnmapMemObject(cl_command_queue queue, cl_mem memory, void* data,
                                               cl_uint count, const cl_event* wait,
                                               cl_event* event) {
  if (FaultAt("kept")) return CL_SUCCESS;
  if (FaultAt("twice")) clEnqueueUnmapMemObject(queue, memory, data, 0, nullptr, nullptr);
  const std::lock_guard lock(The().mutex);
  std::vector<Range>& ranges = The().buffers[memory].ranges;
  const auto found = std::find_if(ranges.begin(), ranges.end(),
                                  [&](const Range& range) { return range.data() == data; });
  if (!Expect(found != ranges.end(), "unmapped without having been mapped"))
    return CL_INVALID_VALUE;
  const Range range = *found;
  ranges.erase(found);
  Close(range);
  return REAL(clEnqueueUnmapMemObject)(queue, memory, range.real, count, wait, event);
}

STAGE_SHIM_CALL cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking,
                                            std::size_t offset, std::size_t bytes, const void* data,
                                            cl_uint count, const cl_event* wait, cl_event* event) {
  const std::lock_guard lock(The().mutex);
  if (!MayBeTransferred(memory, bytes)) return CL_INVALID_OPERATION;
  return REAL(clEnqueueWriteBuffer)(queue, memory, blocking, offset, bytes, data, count, wait,
                                    event);
}

STAGE_SHIM_CALL cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking,
                                           std::size_t offset, std::size_t bytes, void* data,
                                           cl_uint count, const cl_event* wait, cl_event* event) {
  const std::lock_guard lock(The().mutex);
  if (!MayBeTransferred(memory, bytes)) return CL_INVALID_OPERATION;
  return REAL(clEnqueueReadBuffer)(queue, memory, blocking, offset, bytes, data, count, wait,
                                   event);
}

STAGE_SHIM_CALL cl_int clWaitForEvents(cl_uint count, const cl_event* events) {
  const cl_int result = REAL(clWaitForEvents)(count, events);
  const std::lock_guard lock(The().mutex);
  const std::vector<cl_event> waited(events, events + count);
  if (!FaultAt("unseen", true)) Open(&waited);
  return result;
}

STAGE_SHIM_CALL cl_int clFinish(cl_command_queue queue) {
  const cl_int result = REAL(clFinish)(queue);
  const std::lock_guard lock(The().mutex);
  if (!FaultAt("unseen", true)) Open(nullptr);
  return result;
}
