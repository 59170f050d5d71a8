// SPDX-License-Identifier: GPL-2.0-or-later
//
// The entry point of a backend: what a plug-in with a prefilter exports. Plug-in and libstage share
// C++ objects, so the entry point first states how they were built. A plug-in with another version
// or layout is rejected before any of its code is called.
//
// A plug-in needs only this line, in one of its source files:
//
//   STAGE_EXPORT_BACKEND(Make, List)

#ifndef STAGE_SENSING_BACKEND_HH
#define STAGE_SENSING_BACKEND_HH

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>

#include "random/fnv1a.hh"
#include "sensing/device_batch.hh"
#include "sensing/device_layers.hh"
#include "sensing/prefilter.hh"

namespace Stg::internal::sensing {

/// Raise it whenever the meaning of an interface between libstage and plug-ins changes.
inline constexpr uint32_t kBackendVersion = 6;

/// A hash that differs if the layout of shared objects differs.
constexpr uint64_t BackendLayout() {
  uint64_t hash = kFnv1aStart;
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
    hash = Fnv1aStep(hash, size);
  return hash;
}

/// Receives a text, which it must copy.
using TextSink = void (*)(void* user, const char* text);

/// Exported as `stage_backend`. The first three members are the same in every version.
struct Backend {
  uint32_t version;  ///< kBackendVersion
  uint32_t size;     ///< size of this struct in bytes
  uint64_t layout;   ///< BackendLayout()
  /// Makes a prefilter, which the caller must delete. `choice` selects the device (empty: the best
  /// one). If there is no such device, returns null and reports a message that lists the devices.
  /// Never throws.
  Prefilter* (*make)(const char* choice, TextSink tell, void* user);
  /// Reports a text with one line per device, or the reason why there is none. Never throws.
  void (*list)(TextSink tell, void* user);
};

/// Calls `f` on behalf of a plug-in and reports an exception as a message.
template <typename F>
void CallForBackend(TextSink tell, void* user, F f) noexcept {
  try {
    f();
  } catch (const std::exception& error) {
    tell(user, error.what());
  } catch (...) {
    tell(user, "an exception of unknown type was thrown");
  }
}

}  // namespace Stg::internal::sensing

/// `make_prefilter`(const std::string& choice, std::string* message) returns a std::unique_ptr to a
/// prefilter, or null. `list_devices`() returns a std::string.
#define STAGE_EXPORT_BACKEND(make_prefilter, list_devices)                                   \
  extern "C" __attribute__((visibility("default")))                                          \
  const Stg::internal::sensing::Backend stage_backend;                                       \
  const Stg::internal::sensing::Backend stage_backend = {                                    \
      Stg::internal::sensing::kBackendVersion, sizeof(Stg::internal::sensing::Backend),      \
      Stg::internal::sensing::BackendLayout(),                                               \
      [](const char* choice, Stg::internal::sensing::TextSink tell, void* user) {            \
        Stg::internal::sensing::Prefilter* made = nullptr;                                   \
        Stg::internal::sensing::CallForBackend(tell, user, [&] {                             \
          std::string message;                                                               \
          made = make_prefilter(std::string(choice), &message).release();                    \
          if (!made) tell(user, message.c_str());                                            \
        });                                                                                  \
        return made;                                                                         \
      },                                                                                     \
      [](Stg::internal::sensing::TextSink tell, void* user) {                                \
        Stg::internal::sensing::CallForBackend(tell, user,                                   \
                                               [&] { tell(user, list_devices().c_str()); }); \
      }}

#endif
