// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arrays of the robots of a batch whose worlds are stepped on a device. Each array is in the
// device's memory, and created on demand. If CUDA has the device, it is exported from there;
// otherwise a copy for NumPy is updated after each call that changes the worlds.

#ifndef STAGE_PYTHON_DEVICE_CROWD_HH
#define STAGE_PYTHON_DEVICE_CROWD_HH

#include <nanobind/nanobind.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "array.hh"
#include "crowd.hh"
#include "device_plan.hh"
#include "rows/device_rows.hh"
#include "source.hh"
#include "worlds/pool_access.hh"

namespace Stg::python {

class DeviceCrowd : public std::enable_shared_from_this<DeviceCrowd> {
 public:
  /// Throws Failure if the device cannot step all worlds of the source, which owns this object.
  DeviceCrowd(const std::shared_ptr<Source>& source, std::shared_ptr<Crowd> crowd);

  size_t size() const { return crowd_->size(); }

  // Like the functions of Crowd. An array is a NumPy view, or a DeviceArray.

  nb::object BodyArray(const std::string& name);
  nb::object StalledArray();
  nb::object CommandArray();
  nb::object SensorArray(const std::string& type, size_t index, size_t max_count,
                         const std::string& reading);
  nb::object TimeArray();
  nb::object EndedArray();

  /// Whether calls wait for CUDA's work before and after them. Setting it throws Failure if the
  /// device does not work in CUDA's default stream.
  bool waits() const { return waits_; }
  void SetWaits(bool waits);

  // Only the source calls the functions below, without the GIL. They throw Failure.

  /// Gives commands to these worlds, which Step() does, too.
  void Command(std::span<const uint32_t> worlds);
  /// Gives commands to these worlds, steps them and updates the arrays.
  void Step(std::span<const uint32_t> worlds, uint64_t steps);
  /// Resets worlds, sets their commands to 0 and updates the arrays. All worlds must have the same
  /// variant afterwards. `values`: see PoolAccess::Reset().
  void Reset(std::span<const uint32_t> worlds, const std::vector<uint64_t>& seeds,
             const std::optional<std::vector<uint32_t>>& variants,
             const std::optional<PoolAccess::OwnValues>& values);
  /// See PoolAccess::CarryToVariant().
  void CarryToVariant(uint32_t variant, const PoolAccess::OwnValues& values);
  /// Resets the worlds that have a flag, which keep their seeds, like Reset(). Only if
  /// CanResetFlagged().
  void ResetFlagged(const rows::RowInput& flags);
  /// True if the states after loading do not depend on the seeds.
  bool CanResetFlagged() { return !Rows()->DependsOnSeed(); }
  /// Moves robots and updates the arrays; see Crowd::Teleport().
  void Teleport(const rows::RowInput& poses, const rows::RowInput& which);
  /// True if the device can read the memory of CUDA.
  bool ReadsCuda() { return Rows()->device().IsInDefaultStream(); }
  /// Updates the arrays after another change of worlds.
  void Update();

 private:
  friend class DeviceArray;
  using Planner = std::function<DevicePlan(const RowRobots& robots)>;
  struct Member;
  class Lock;

  nb::object Find(const std::string& name, const Planner& plan, bool flags = false);
  std::shared_ptr<Member> Make(const std::string& name, const Planner& plan, bool flags);
  nb::object View(const std::shared_ptr<Member>& member);
  void Subscribe(const Planner& plan);
  const RowRobots& Robots();
  rows::DeviceRows* Rows();
  Member* Commands();
  void WaitForClients();
  void SetParts(Member* member, bool is_new);
  void PlanIfNew();
  rows::RowChoice ChoiceOf(std::span<const uint32_t> worlds) const;
  void Gather(std::span<const std::shared_ptr<Member>> members,
              const rows::RowChoice& worlds = rows::RowChoice());
  void GiveCommands(std::span<const uint32_t> worlds);
  uint32_t StepsOfLaunch(uint64_t left);

  const std::weak_ptr<Source> source_;
  WorldPool& pool_;
  const std::shared_ptr<Crowd> crowd_;
  std::vector<std::shared_ptr<Member>> members_;
  bool waits_ = true;
  bool has_stepped_ = false;              // some worlds may have
  const rows::Scene* planned_ = nullptr;  // for which arrays are planned
  double step_seconds_ = 0;               // recent time of a step of all worlds; 0: unknown
};

/// An array in CUDA's memory.
class DeviceArray {
 public:
  DeviceArray(std::shared_ptr<DeviceCrowd> crowd, std::shared_ptr<DeviceCrowd::Member> member)
      : crowd_(std::move(crowd)), member_(std::move(member)) {}

  nb::object Shape() const;
  const char* DtypeName() const;
  /// A capsule of DLPack. Everything that writes the array has ended, so that each stream may read
  /// it.
  nb::object Dlpack(const nb::kwargs&) const;
  nb::tuple DlpackDevice() const;
  /// A copy for NumPy.
  nb::object Numpy() const;
  /// Writes the array, which is that of the commands.
  void Write(const nb::ndarray<const double, nb::c_contig, nb::device::cpu>& from);

 private:
  const std::shared_ptr<DeviceCrowd> crowd_;
  const std::shared_ptr<DeviceCrowd::Member> member_;
};

}  // namespace Stg::python

#endif
