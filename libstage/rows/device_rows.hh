// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rows whose columns are on a device and are stepped there, with the same bits as on the host.

#ifndef STAGE_ROWS_DEVICE_ROWS_HH
#define STAGE_ROWS_DEVICE_ROWS_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rows/device_contacts.hh"
#include "rows/device_image.hh"
#include "rows/row_backend.hh"
#include "rows/rows.hh"

namespace Stg::rows {

/// Opens a device of the OpenCL plug-in and tests it, see SelfTest(). `choice` is the text after
/// --opencl=, `work_items` the number of work-items for a world (0: the device's choice). Returns
/// null and a message if there is none that can step rows.
std::unique_ptr<RowDevice> OpenRowDevice(const std::string& choice, uint32_t work_items,
                                         std::string* message);

/// Makes OpenRowDevice() return what `make` returns; null: devices of the plug-in again. For tests.
void ReplaceRowDevices(std::function<std::unique_ptr<RowDevice>()> make);

/// Steps some worlds on the device and on the host. Returns what differs, in one line; empty if the
/// device has the same bits.
std::string SelfTest(RowDevice* device);

/// SelfTest() as a message that names the device; empty if it passes. The plug-in also calls it in
/// the process in which it tries drivers, so that a driver that crashes or hangs does no harm.
std::string WhyUnfit(RowDevice* device);

/// A set of columns: bit ROW_... of kernels/row_records.h.
using ColumnSet = uint64_t;
inline constexpr ColumnSet kAllColumns = (ColumnSet{1} << ROW_COLUMNS) - 1;

/// All functions throw RowDeviceError.
class DeviceRows {
 public:
  /// Worlds in an unspecified state: call Write() or Reset() first. The scene can be stepped on a
  /// device, see WhyNotOnDevice(). `work_items` of a world; 0: the device's choice.
  /// `contact_bytes`: see kContactBytes.
  DeviceRows(std::shared_ptr<const Scene> scene, size_t worlds, std::shared_ptr<RowDevice> device,
             uint32_t work_items = 0, size_t contact_bytes = kContactBytes);

  /// Sends what stands anew if it has changed, see ChangingMap, which takes as long as making the
  /// rows. Returns true if so; worlds are in an unspecified state then.
  bool Renew();

  size_t size() const { return worlds_; }
  RowDevice& device() { return *device_; }
  /// Copies columns of all worlds from or to rows of the same scene and size.
  void Write(const Rows& from, ColumnSet columns = kAllColumns);
  void Read(Rows* to, ColumnSet columns = kAllColumns);
  /// Starts `steps` steps of all worlds with the commands that were written last. Nobody looks at
  /// readings before `unseen` further steps.
  void Step(uint32_t steps, uint32_t unseen = 0) { device_->Step(steps, unseen); }
  /// Starts steps of some worlds.
  void StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen = 0) {
    device_->StepSome(worlds, steps, unseen);
  }
  /// True if some controller is not built in: the host calls all of them after each step, between
  /// ReadForControls() and WriteControls(), and has the newest memory of controllers.
  bool has_controls_on_host() const { return !of_controls_.empty(); }
  /// Reads what controllers need. After that, each thread may call TakeForControls().
  void ReadForControls();
  void TakeForControls(size_t world, Rows* to) const;
  void WriteControls(const Rows& from);
  /// Columns that only the host has.
  ColumnSet of_host() const { return of_host_; }
  /// Starts to give robots commands. No robot is listed twice.
  void Give(std::span<const row_given_t> commands) { device_->Give(commands); }
  /// Resets worlds, which differ, to their states after loading with these seeds. `given`: for each
  /// world the numbers of Scene::varied, see Rows::Reset().
  void Reset(std::span<const uint32_t> worlds, std::span<const uint64_t> seeds,
             std::span<const std::span<const double>> given = {});
  /// Puts worlds, which differ, into states, except for columns that come from their own rows in
  /// `own`. Each of `starts` has one world; `start_of` has the index of that of each world.
  void Restore(std::span<const uint32_t> worlds, std::span<const Rows* const> starts,
               std::span<const uint32_t> start_of, const Rows& own, ColumnSet of_own);
  /// Chooses the movers that are watched. There is room for their numbers at this many moments, or
  /// as many as fit into kWatchedBytes.
  void Watch(std::span<const uint32_t> movers, size_t moments = 1);
  static constexpr size_t kWatchedBytes = size_t{64} << 20;
  /// Number of moments that there is room for, at least 1.
  size_t moments() const { return moments_; }
  /// Starts to note the numbers of these worlds at a moment.
  void NoteWatched(std::span<const uint32_t> worlds, size_t moment);
  /// Returns what was noted at the first `moments` moments, one after the other: kWatchedNumbers
  /// numbers of each mover in each world: pose, velocity, and 1 if it has stalled. Those of worlds
  /// that were not noted are unspecified. They stay valid until the next call.
  std::span<const double> ReadWatched(size_t moments);
  static constexpr size_t kWatchedNumbers = 7;
  /// True if states after loading depend on the seed, so that RowDevice::ResetFlagged() must not be
  /// called.
  bool DependsOnSeed() const { return depends_on_seed_; }

 private:
  void Begin();
  void PlanControls();
  void AddStart(const Rows& start);
  /// Numbers of all worlds at a moment.
  size_t NumbersOfMoment() const { return worlds_ * kWatchedNumbers * watched_.size(); }

  const std::shared_ptr<const Scene> scene_;
  const size_t worlds_;
  const uint32_t work_items_;
  const size_t contact_bytes_;
  uint64_t map_version_;  // of the image, see Scene
  DeviceImage image_;
  const std::shared_ptr<RowDevice> device_;
  ColumnSet own_ = 0;  // columns that depend on the seed, which is one of them, or vary
  bool depends_on_seed_ = false;
  std::unique_ptr<Rows> reset_;  // one world
  std::vector<std::byte> buffer_, start_;
  std::vector<int> of_controls_;  // columns that they need
  ColumnSet of_host_ = 0;
  std::vector<size_t> places_of_controls_;  // by column, in read_for_controls_
  std::shared_ptr<std::byte> read_for_controls_;
  std::vector<uint32_t> watched_;
  size_t moments_ = 1;
  std::shared_ptr<RowMemory> watched_memory_;
  std::shared_ptr<std::byte> watched_numbers_;
};

}  // namespace Stg::rows

#endif
