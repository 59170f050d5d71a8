// SPDX-License-Identifier: GPL-2.0-or-later
//
// The door of a backend: what a plug-in that brings a prefilter exports. Behind it C++ objects of
// both sides meet, so that it says first how they were built; a plug-in that was built otherwise is
// refused before anything of it is called.
//
//   STAGE_EXPORT_BACKEND(Make, List)
//
// in one source of the plug-in is all that it takes.

#ifndef STAGE_SENSING_BACKEND_HH
#define STAGE_SENSING_BACKEND_HH

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>

#include "sensing/device_batch.hh"
#include "sensing/device_layers.hh"
#include "sensing/prefilter.hh"

namespace Stg::internal::sensing {

/// To be raised whenever what a plug-in may call, or is called for, changes its meaning.
inline constexpr uint32_t kBackendVersion = 5;

/// A number that differs where objects that pass the door are laid out differently.
constexpr uint64_t BackendLayout() {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const std::size_t size : {sizeof(void*),
                                 sizeof(std::string),
                                 sizeof(Prefilter),
                                 sizeof(HitLists),
                                 sizeof(PrefilterStatistics),
                                 sizeof(PrefilterError),
                                 sizeof(grid::Grid),
                                 sizeof(grid::Occupancy),
                                 sizeof(DirectionTables),
                                 sizeof(RayBatch),
                                 sizeof(Fan),
                                 sizeof(DeviceFan),
                                 sizeof(DeviceBatch),
                                 sizeof(DeviceLayers),
                                 sizeof(threads::WorkerPool),
                                 sizeof(ray_fan_record_t),
                                 sizeof(ray_group_record_t),
                                 sizeof(ray_direction_t),
                                 sizeof(ray_grid_t),
                                 std::size_t{__GXX_ABI_VERSION}})
    hash = (hash ^ size) * 0x100000001b3u;
  return hash;
}

/// Takes a text, of which it keeps a copy.
using TakeText = void (*)(void* user, const char* text);

/// What is exported as `stage_backend`. The first three members stay what they are in every
/// version.
struct Backend {
  uint32_t version;  ///< kBackendVersion
  uint32_t size;     ///< of this struct
  uint64_t layout;   ///< BackendLayout()
  /// A prefilter, to be deleted by the caller. `choice`: which device (empty: the best one). Null
  /// and a message if there is no such device; the message lists those that there are. Throws
  /// nothing.
  Prefilter* (*make)(const char* choice, TakeText tell, void* user);
  /// Gives a text with one line for each device, or why there is none. Throws nothing.
  void (*list)(TakeText tell, void* user);
};

/// Calls `f`, which may throw, for a plug-in, and tells what was thrown.
template <typename F>
void CallForBackend(TakeText tell, void* user, F f) noexcept {
  try {
    f();
  } catch (const std::exception& error) {
    tell(user, error.what());
  } catch (...) {
    tell(user, "something was thrown that is no exception");
  }
}

}  // namespace Stg::internal::sensing

/// `make_prefilter`: a std::unique_ptr to a prefilter, or null, from (const std::string& choice,
/// std::string* message). `list_devices`: a std::string from ().
#define STAGE_EXPORT_BACKEND(make_prefilter, list_devices)                                   \
  extern "C" __attribute__((visibility("default")))                                          \
  const Stg::internal::sensing::Backend stage_backend;                                       \
  const Stg::internal::sensing::Backend stage_backend = {                                    \
      Stg::internal::sensing::kBackendVersion, sizeof(Stg::internal::sensing::Backend),      \
      Stg::internal::sensing::BackendLayout(),                                               \
      [](const char* choice, Stg::internal::sensing::TakeText tell, void* user) {            \
        Stg::internal::sensing::Prefilter* made = nullptr;                                   \
        Stg::internal::sensing::CallForBackend(tell, user, [&] {                             \
          std::string message;                                                               \
          made = make_prefilter(std::string(choice), &message).release();                    \
          if (!made) tell(user, message.c_str());                                            \
        });                                                                                  \
        return made;                                                                         \
      },                                                                                     \
      [](Stg::internal::sensing::TakeText tell, void* user) {                                \
        Stg::internal::sensing::CallForBackend(tell, user,                                   \
                                               [&] { tell(user, list_devices().c_str()); }); \
      }}

#endif
