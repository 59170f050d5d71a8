// SPDX-License-Identifier: GPL-2.0-or-later
//
// CUDA's driver library. It is looked for at run time, because few machines have one.

#ifndef STAGE_CL_CUDA_HH
#define STAGE_CL_CUDA_HH

#include <cstddef>
#include <cstdint>
#include <memory>

#include "libstage_cl/opencl.hh"

namespace Stg::cl {

/// Declarations of the library, see NVIDIA's reference of the driver API.
namespace cuda {

using Result = int;  ///< 0: success
using Context = void*;
using Module = void*;
using Function = void*;
using Address = uintptr_t;
using Allocation = unsigned long long;

enum { kDevice = 1, kPinned = 1, kFileDescriptor = 1, kReadAndWrite = 3, kSmallestUnit = 0 };
enum { kMaxThreadsPerBlock = 0 };

struct Uuid {
  char bytes[16];
};
struct Location {
  int type, number;
};
struct AllocationProperties {
  int type, handle_types;
  Location location;
  void* unused;
  unsigned char flags[8];
};
struct Access {
  Location location;
  int flags;
};

struct Functions {
  Result (*initialize)(unsigned);
  Result (*count_devices)(int*);
  Result (*get_device)(int*, int);
  Result (*get_uuid)(Uuid*, int);
  Result (*retain_primary_context)(Context*, int);
  Result (*push_context)(Context);
  Result (*pop_context)(Context*);
  Result (*synchronize)();
  Result (*get_error_name)(Result, const char**);
  // Memory that can be exported.
  Result (*get_unit)(size_t*, const AllocationProperties*, int);
  Result (*create)(Allocation*, size_t, const AllocationProperties*, unsigned long long);
  Result (*export_handle)(void*, Allocation, int, unsigned long long);
  Result (*reserve)(Address*, size_t, size_t, Address, unsigned long long);
  Result (*map)(Address, size_t, size_t, Allocation, unsigned long long);
  Result (*set_access)(Address, size_t, const Access*, size_t);
  Result (*unmap)(Address, size_t);
  Result (*free_address)(Address, size_t);
  Result (*release)(Allocation);
  // Memory and kernels.
  Result (*allocate)(Address*, size_t);
  Result (*free)(Address);
  Result (*to_device)(Address, const void*, size_t);
  Result (*to_host)(void*, Address, size_t);
  Result (*allocate_on_host)(void**, size_t);  // memory that copies need no detour for
  Result (*free_on_host)(void*);
  Result (*load_module)(Module*, const void*);
  Result (*unload_module)(Module);
  Result (*get_function)(Function*, Module, const char*);
  Result (*get_attribute)(int*, int, Function);
  Result (*launch)(Function, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned,
                   void*, void**, void**);
};

}  // namespace cuda

/// A device of OpenCL that CUDA has as well.
class CudaDevice {
 public:
  /// Returns null if CUDA is not there, or does not have the device.
  static std::shared_ptr<CudaDevice> Find(const ::cl::Device& device);

  CudaDevice(const cuda::Functions& functions, int number, cuda::Context context)
      : functions_(functions), number_(number), context_(context) {}
  const cuda::Functions& functions() const { return functions_; }
  int number() const { return number_; }
  /// Waits until everything in the device's primary context, which other libraries use, is done.
  bool Wait() const;

  /// Makes the device's primary context that of the thread.
  class Current {
   public:
    explicit Current(const CudaDevice& device)
        : functions_(device.functions_),
          is_set_(device.functions_.push_context(device.context_) == 0) {}
    ~Current() {
      cuda::Context context;
      if (is_set_) functions_.pop_context(&context);
    }
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;
    explicit operator bool() const { return is_set_; }

   private:
    const cuda::Functions& functions_;
    const bool is_set_;
  };

 private:
  const cuda::Functions& functions_;
  const int number_;
  const cuda::Context context_;
};

}  // namespace Stg::cl

#endif
