// SPDX-License-Identifier: GPL-2.0-or-later
//
// The interface to a device that steps closed worlds, and what a plug-in with such a device
// exports. A device knows neither worlds nor columns: it keeps buffers and runs the kernels of
// kernels/row_step.cl and kernels/islands.cl on them.

#ifndef STAGE_ROWS_ROW_BACKEND_HH
#define STAGE_ROWS_ROW_BACKEND_HH

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "kernels/row_records.h"
#include "random/fnv1a.hh"
#include "sensing/backend.hh"

namespace Stg::rows {

/// True if an image is of a scene with contacts of outlines, which other kernels step.
inline bool HasOutlines(std::span<const uint64_t> image) {
  return reinterpret_cast<const row_scene_t*>(image.data())->outlines != 0;
}

/// A device that fails. The state on it is lost.
struct RowDeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Sizes of the buffers of a device.
struct RowBuffers {
  size_t movers = 0;        ///< of a world
  size_t rays = 0;          ///< of a world
  uint32_t work_items = 0;  ///< for a world; 0: the device's choice
  size_t worlds = 0;
  size_t state_bytes = 0;    ///< columns of all worlds
  size_t scratch_bytes = 0;  ///< memory of all worlds during a step
};

/// Elements of an array that come from one column, see kernels/row_arrays.h.
struct RowPart {
  row_array_t array{};
  std::vector<row_entry_t> entries;
  std::vector<double> values;  ///< ROW_LOOKED_UP
};

/// Data of a client, on the host or in CUDA's memory.
struct RowInput {
  const void* data;
  size_t bytes;
  bool is_in_cuda = false;
};

/// States that worlds are put into, one after the other as in ROW_START.
struct RowStarts {
  std::span<const std::byte> states;
  size_t bytes = 0;                    ///< of a state
  std::span<const uint32_t> of_world;  ///< number of the state of each world
};

/// Worlds that a call concerns: all, those of a list, or those whose byte in `flags` is not 0.
struct RowChoice {
  RowChoice() = default;
  explicit RowChoice(std::span<const uint32_t> worlds) : kind(ROW_LISTED_WORLDS), list(worlds) {}
  explicit RowChoice(const RowInput& given) : kind(ROW_FLAGGED_WORLDS), flags(given) {}

  uint32_t kind = ROW_ALL_WORLDS;
  std::span<const uint32_t> list{};
  RowInput flags{nullptr, 0};
};

/// Calls f(first, all, items) for parts of the chosen ones of `worlds` worlds that have at most
/// 2^31 entries, if each has `count`: the number of the part's first world, of all chosen or
/// flagged worlds, and of the part's entries.
template <typename F>
void ForEachPartOfEntries(size_t worlds, const RowChoice& choice, uint32_t count, F f) {
  const size_t all = choice.kind == ROW_LISTED_WORLDS ? choice.list.size() : worlds;
  const size_t most = std::max<size_t>(1, (size_t{1} << 31) / std::max(1u, count));
  for (size_t first = 0; count > 0 && first < all; first += most)
    f(static_cast<uint32_t>(first), static_cast<uint32_t>(all),
      std::min(most, all - first) * count);
}

/// Memory on a device for an array of all worlds. It stays valid without the device.
class RowMemory {
 public:
  explicit RowMemory(size_t bytes) : bytes_(bytes) {}
  virtual ~RowMemory() = default;
  RowMemory(const RowMemory&) = delete;
  RowMemory& operator=(const RowMemory&) = delete;

  size_t bytes() const { return bytes_; }
  /// Its address for CUDA, and the number of CUDA's device; null if CUDA cannot access it.
  void* cuda_address() const { return cuda_address_; }
  int cuda_device() const { return cuda_device_; }

 protected:
  void* cuda_address_ = nullptr;
  int cuda_device_ = 0;

 private:
  const size_t bytes_;
};

/// All functions but Name() throw RowDeviceError.
class RowDevice {
 public:
  virtual ~RowDevice() = default;
  virtual std::string Name() const = 0;
  /// A device with buffers of its own on the same hardware. What either is told to do is done in
  /// this order.
  virtual std::unique_ptr<RowDevice> Another() const = 0;
  /// Sends an image, see row_scene_t, and makes the buffers. The state is unspecified.
  virtual void Begin(std::span<const uint64_t> image, const RowBuffers& buffers) = 0;
  /// Writes and reads bytes of the state. Both wait until they are done.
  virtual void Write(size_t offset, const void* from, size_t bytes) = 0;
  virtual void Read(size_t offset, void* to, size_t bytes) = 0;
  /// Memory of the host that Read() and ReadMemory() copy to fastest; valid as long as the device.
  virtual std::shared_ptr<std::byte> MakeHostMemory(size_t bytes) {
    return {new std::byte[bytes], std::default_delete<std::byte[]>()};
  }
  /// Starts steps of all worlds. Nobody looks at readings before `unseen` further steps.
  virtual void Step(uint32_t steps, uint32_t unseen) = 0;
  /// Starts steps of some worlds.
  virtual void StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) = 0;
  /// Starts to reset some worlds. `columns` has a bit for each column that does not come from
  /// ROW_START; `given` has those columns of the first world, then of the second one, and so on.
  virtual void Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
                     uint64_t columns) = 0;
  /// Like Reset(), but the other columns come from `starts`.
  virtual void Restore(std::span<const uint32_t> worlds, const RowStarts& starts,
                       std::span<const std::byte> given, uint64_t columns) = 0;
  /// Starts to give robots commands. No robot is listed twice.
  virtual void Give(std::span<const row_given_t> commands) = 0;
  /// Waits until everything that was started is done.
  virtual void Finish() = 0;

  // Arrays. Those of other hardware must not be passed.

  /// Makes memory for an array, if possible such that CUDA can access it.
  virtual std::shared_ptr<RowMemory> MakeMemory(size_t bytes) = 0;
  /// Sets what Gather() and GiveCommands() do. The parts belong to the scene of Begin().
  virtual void SetParts(RowMemory* memory, const std::vector<RowPart>& parts) = 0;
  /// Starts to copy elements of the state of worlds to the memory, from `offset` bytes on, a
  /// multiple of 8.
  virtual void Gather(RowMemory* memory, const RowChoice& worlds, size_t offset = 0) = 0;
  /// Starts to copy commands of worlds from the memory.
  virtual void GiveCommands(RowMemory* memory, const RowChoice& worlds) = 0;
  /// Starts to set the bytes of worlds in the memory to 0. They are words of 8 bytes.
  virtual void Clear(RowMemory* memory, const RowChoice& worlds, uint32_t words_per_world) = 0;
  /// Starts to move robots of all worlds to other poses, without collision tests. `entries`: number
  /// of the robot and index of the mover. `poses`: x, y and heading by robot of each world;
  /// `chosen`: a byte for each, 0 if it stays.
  virtual void Place(const std::vector<row_entry_t>& entries, uint32_t robots,
                     const RowInput& poses, const RowInput& chosen) = 0;
  /// Starts to reset those worlds whose byte in `flags` is not 0. They keep their seeds, on which
  /// their states must not depend.
  virtual void ResetFlagged(const RowInput& flags) = 0;
  /// Writes the whole memory, or reads its first bytes. Both wait until they are done.
  virtual void WriteMemory(RowMemory* memory, const void* from) = 0;
  virtual void ReadMemory(RowMemory* memory, void* to, size_t bytes) = 0;
  /// Waits until everything that this process has started by CUDA is done.
  virtual void WaitForCuda() = 0;
  /// True if everything is started in CUDA's default stream, so that other work there needs no
  /// waiting.
  virtual bool IsInDefaultStream() const { return false; }
};

/// Raise it whenever the meaning of the interface or of an image changes.
inline constexpr uint32_t kRowBackendVersion = 9;

/// A hash that differs if the layout of shared objects or of records differs.
constexpr uint64_t RowBackendLayout() {
  uint64_t hash = kFnv1aStart;
  for (const size_t size :
       {sizeof(void*), sizeof(std::string), sizeof(RowDevice), sizeof(RowBuffers),
        sizeof(row_scene_t), sizeof(row_mover_t), sizeof(row_body_t), sizeof(row_sensor_t),
        sizeof(row_fragment_t), sizeof(row_array_t), sizeof(row_given_t), sizeof(RowPart),
        size_t{ROW_COLUMNS}, size_t{ROW_PARTS}, size_t{ROW_SCRATCHES}, size_t{__GXX_ABI_VERSION}})
    hash = Fnv1aStep(hash, size);
  return hash;
}

/// Exported as `stage_row_backend`. The first three members are the same in every version.
struct RowBackend {
  uint32_t version;  ///< kRowBackendVersion
  uint32_t size;     ///< size of this struct in bytes
  uint64_t layout;   ///< RowBackendLayout()
  /// Makes a device, which the caller must delete. `choice` selects it (empty: the best one),
  /// `work_items` is the number of work-items for a world (0: the device's choice). Returns null
  /// and reports a message if there is no such device. Never throws.
  RowDevice* (*make)(const char* choice, uint32_t work_items, internal::sensing::TextSink tell,
                     void* user);
};

}  // namespace Stg::rows

/// `make_device`(const std::string& choice, uint32_t work_items, std::string* message) returns a
/// std::unique_ptr to a device, or null.
#define STAGE_EXPORT_ROW_BACKEND(make_device)                                                      \
  extern "C" __attribute__((visibility("default"))) const Stg::rows::RowBackend stage_row_backend; \
  const Stg::rows::RowBackend stage_row_backend = {                                                \
      Stg::rows::kRowBackendVersion, sizeof(Stg::rows::RowBackend), Stg::rows::RowBackendLayout(), \
      [](const char* choice, uint32_t work_items, Stg::internal::sensing::TextSink tell,           \
         void* user) {                                                                             \
        Stg::rows::RowDevice* made = nullptr;                                                      \
        Stg::internal::sensing::CallForBackend(tell, user, [&] {                                   \
          std::string message;                                                                     \
          made = make_device(std::string(choice), work_items, &message).release();                 \
          if (!made) tell(user, message.c_str());                                                  \
        });                                                                                        \
        return made;                                                                               \
      }}

#endif
