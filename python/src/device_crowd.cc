// SPDX-License-Identifier: GPL-2.0-or-later

#include "device_crowd.hh"

#include <algorithm>
#include <cstring>
#include <utility>

#include "array_groups.hh"
#include "gil.hh"
#include "signals.hh"
#include "threads/wall_clock.hh"

namespace Stg::python {

struct DeviceCrowd::Member {
  std::string name;
  Planner plan;
  bool flags;  // bytes, otherwise doubles
  std::vector<size_t> shape;
  std::shared_ptr<rows::RowMemory> memory;
  bool lacks_models = false;  // that must run, so that elements have no values
  Array host;                 // without CUDA

  nb::dlpack::dtype Dtype() const { return flags ? nb::dtype<bool>() : nb::dtype<double>(); }
  bool IsCommands() const { return name == "cmd"; }
};

namespace {

/// Calls f() and turns errors of the device into failures.
template <typename F>
auto WithDevice(F f) {
  try {
    return f();
  } catch (const rows::RowDeviceError& error) {
    throw Failure{Kind::kStage, error.what()};
  }
}

/// The bytes of the elements that an array of all worlds has at first.
std::vector<std::byte> BytesOf(const DevicePlan& plan, size_t worlds, bool flags) {
  std::vector<std::byte> of_world;
  for (const double value : plan.fill) {
    const auto flag = static_cast<std::byte>(value != 0);
    const auto* const bytes = flags ? &flag : reinterpret_cast<const std::byte*>(&value);
    of_world.insert(of_world.end(), bytes, bytes + (flags ? sizeof flag : sizeof value));
  }
  std::vector<std::byte> all;
  all.reserve(worlds * of_world.size());
  for (size_t i = 0; i < worlds; i++) all.insert(all.end(), of_world.begin(), of_world.end());
  return all;
}

}  // namespace

/// Exclusive access to the worlds for a call from Python.
class DeviceCrowd::Lock {
 public:
  explicit Lock(const DeviceCrowd& crowd) : source_(crowd.source_.lock()) {
    if (!source_) throw Failure{Kind::kGone, "the worlds of these robots are gone"};
    use_.emplace(source_.get());
  }

 private:
  const std::shared_ptr<Source> source_;
  std::optional<Source::Use> use_;
};

DeviceCrowd::DeviceCrowd(const std::shared_ptr<Source>& source, std::shared_ptr<Crowd> crowd)
    : source_(source), pool_(*source->pool()), crowd_(std::move(crowd)) {
  Rows();
}

/// The rows of all worlds on the device, with their newest state. Throws Failure.
rows::DeviceRows* DeviceCrowd::Rows() {
  rows::DeviceRows* const rows = WithDevice([&] { return PoolAccess::OnDevice(pool_); });
  if (rows) return rows;
  for (uint32_t id = 0; id < pool_.size(); id++) {
    if (!pool_.Failure(id).empty())
      throw Failure{Kind::kWorld, "world " + std::to_string(id) + " has failed (" +
                                      pool_.Failure(id) + "): reset or restore it"};
    const std::string reason = pool_.WhyNotOnDevice(id);
    if (!reason.empty())
      throw Failure{Kind::kWorld, pool_.StepDevice() + " can't step world " + std::to_string(id) +
                                      ", because " + reason + "; make the batch without device="};
  }
  throw Failure{Kind::kWorld, "the worlds have different subscriptions: reset all of them"};
}

const RowRobots& DeviceCrowd::Robots() {
  const rows::Scene* const scene = PoolAccess::SceneOf(pool_, 0);
  if (!scene) throw Failure{Kind::kWorld, "world 0 has failed: reset or restore it"};
  return crowd_->RobotsIn(*scene);
}

// ---- making arrays ------------------------------------------------------------------------------

/// Subscribes to the models that an array needs, in all worlds, whose scene is another one then.
void DeviceCrowd::Subscribe(const Planner& plan) {
  std::vector<uint32_t> needs = plan(Robots()).needs;
  if (needs.empty()) return;
  if (has_stepped_)
    throw Failure{Kind::kStage,
                  "the array needs robots or sensors that have not run so far: ask for it before "
                  "the first step, or after a reset of all worlds"};
  pool_.ForEach(pool_.All(), [&](uint32_t id) { PoolAccess::Subscribe(pool_, id, needs); });
  Rows();
  PlanIfNew();
  Gather(members_);
}

/// Plans all arrays again if the worlds have another scene.
void DeviceCrowd::PlanIfNew() {
  if (members_.empty()) return;
  Rows();
  if (planned_ == PoolAccess::SceneOf(pool_, 0)) return;
  for (const auto& member : members_) SetParts(member.get(), false);
}

/// Plans the array for the present scene, and writes what does not change. A new array gets its
/// memory.
void DeviceCrowd::SetParts(Member* member, bool is_new) {
  const DevicePlan plan = member->plan(Robots());
  planned_ = PoolAccess::SceneOf(pool_, 0);
  member->lacks_models = !plan.needs.empty();
  WithDevice([&] {
    rows::RowDevice& device = Rows()->device();
    const std::vector<std::byte> bytes = BytesOf(plan, pool_.size(), member->flags);
    if (is_new) {
      member->shape = {pool_.size()};
      member->shape.insert(member->shape.end(), plan.shape.begin(), plan.shape.end());
      member->memory = device.MakeMemory(bytes.size());
    }
    device.SetParts(member->memory.get(), plan.parts);
    if (is_new || !member->IsCommands())  // the client writes commands
      device.WriteMemory(member->memory.get(), bytes.data());
  });
}

/// Makes an array and fills it.
std::shared_ptr<DeviceCrowd::Member> DeviceCrowd::Make(const std::string& name, const Planner& plan,
                                                       bool flags) {
  const auto member = std::make_shared<Member>();
  member->name = name;
  // Commands subscribe to robots when they are first given, which is after all sensors, as on the
  // host.
  if (has_stepped_ || !member->IsCommands()) Subscribe(plan);
  member->plan = plan;
  member->flags = flags;
  SetParts(member.get(), true);
  if (!member->memory->cuda_address()) member->host.Make(member->shape, member->Dtype());
  members_.push_back(member);
  Gather(std::span(&member, 1));
  return member;
}

nb::object DeviceCrowd::Find(const std::string& name, const Planner& plan, bool flags) {
  const Lock lock(*this);
  const auto known = std::ranges::find_if(members_, [&](const auto& m) { return m->name == name; });
  if (known != members_.end()) return View(*known);
  const auto make = [&] {
    const GilRelease no_gil;
    return Make(name, plan, flags);
  };
  return View(make());
}

nb::object DeviceCrowd::View(const std::shared_ptr<Member>& member) {
  if (member->memory->cuda_address()) return nb::cast(DeviceArray(shared_from_this(), member));
  return ViewOf(member->host, shared_from_this(), member->IsCommands());
}

nb::object DeviceCrowd::BodyArray(const std::string& name) {
  return Find(name, [name](const RowRobots& robots) { return PlanBody(name, robots); });
}

nb::object DeviceCrowd::StalledArray() { return Find("stalled", PlanStalled, true); }

nb::object DeviceCrowd::CommandArray() { return Find("cmd", PlanCommands); }

nb::object DeviceCrowd::TimeArray() { return Find("time", PlanTime); }

nb::object DeviceCrowd::EndedArray() { return Find("ended", PlanEnded, true); }

nb::object DeviceCrowd::SensorArray(const std::string& type, size_t index, size_t,
                                    const std::string& reading) {
  const ModelType* const of = &SensorTypeOf(type);
  return Find(type + " " + std::to_string(index) + " " + reading,
              [of, index, reading](const RowRobots& robots) {
                return PlanReading(*of, index, reading, robots);
              });
}

// ---- exchange -----------------------------------------------------------------------------------

DeviceCrowd::Member* DeviceCrowd::Commands() {
  const auto found =
      std::ranges::find_if(members_, [](const auto& member) { return member->IsCommands(); });
  return found == members_.end() ? nullptr : found->get();
}

void DeviceCrowd::SetWaits(bool waits) {
  const Lock lock(*this);
  if (!waits && !Rows()->device().IsInDefaultStream())
    throw Failure{Kind::kStage, pool_.StepDevice() +
                                    " doesn't work in CUDA's default stream, so synchronous must "
                                    "stay True"};
  waits_ = waits;
}

/// Waits until nobody reads or writes arrays any more.
void DeviceCrowd::WaitForClients() {
  if (waits_) Rows()->device().WaitForCuda();
}

rows::RowChoice DeviceCrowd::ChoiceOf(std::span<const uint32_t> worlds) const {
  return worlds.size() == pool_.size() ? rows::RowChoice() : rows::RowChoice(worlds);
}

/// Updates these arrays of the worlds whose state has changed.
void DeviceCrowd::Gather(std::span<const std::shared_ptr<Member>> members,
                         const rows::RowChoice& worlds) {
  if (members.empty()) return;
  rows::RowDevice& device = Rows()->device();
  WithDevice([&] {
    WaitForClients();
    for (const auto& member : members)
      if (!member->IsCommands()) device.Gather(member->memory.get(), worlds);
    if (waits_) device.Finish();
    for (const auto& member : members)
      if (member->host.exists() && !member->IsCommands())
        device.ReadMemory(member->memory.get(), member->host.data(), member->memory->bytes());
  });
}

void DeviceCrowd::Update() {
  has_stepped_ = true;
  PlanIfNew();
  Gather(members_);
}

/// Gives these worlds the commands that other programs have written.
void DeviceCrowd::GiveCommands(std::span<const uint32_t> worlds) {
  Member* const commands = Commands();
  if (!commands) return;
  rows::RowDevice& device = Rows()->device();
  if (commands->host.exists())
    device.WriteMemory(commands->memory.get(), commands->host.data());
  else
    WaitForClients();
  device.GiveCommands(commands->memory.get(), ChoiceOf(worlds));
  PoolAccess::NoteDeviceSteps(pool_);
}

/// The number of steps of a launch of about 50 ms, after which signals are handled. Commands that
/// controllers may replace are given before each step.
uint32_t DeviceCrowd::StepsOfLaunch(uint64_t left) {
  constexpr double kSeconds = 0.05;
  const bool are_replaced = !PoolAccess::SceneOf(pool_, 0)->controls.groups.empty();
  if (are_replaced && Commands()) return 1;
  const double most = step_seconds_ > 0 ? kSeconds / step_seconds_ : 1;
  return static_cast<uint32_t>(
      std::min<uint64_t>(left, static_cast<uint64_t>(std::clamp(most, 1.0, 1e6))));
}

void DeviceCrowd::Command(std::span<const uint32_t> worlds) {
  Member* const commands = Commands();
  if (!commands) return;
  if (!has_stepped_) Subscribe(commands->plan);
  WithDevice([&] {
    GiveCommands(worlds);
    PoolAccess::NoteDeviceSteps(pool_);
  });
}

void DeviceCrowd::Step(std::span<const uint32_t> worlds, uint64_t steps) {
  SignalChecks signals;
  if (Member* const commands = Commands(); commands && !has_stepped_ && steps > 0)
    Subscribe(commands->plan);
  has_stepped_ = has_stepped_ || steps > 0;
  WithDevice([&] {
    for (uint64_t left = steps; left > 0;) {
      const uint32_t count = StepsOfLaunch(left);
      GiveCommands(worlds);
      const double start = threads::WallClock();
      rows::DeviceRows* const rows = Rows();
      worlds.size() == pool_.size() ? rows->Step(count) : rows->StepSome(worlds, count);
      PoolAccess::NoteDeviceSteps(pool_);
      left -= count;
      if (left == 0 && !members_.empty()) break;  // Gather() waits
      rows->device().Finish();
      step_seconds_ = (threads::WallClock() - start) / count;
      signals.Poll();
    }
  });
  Gather(members_, ChoiceOf(worlds));
}

void DeviceCrowd::Reset(std::span<const uint32_t> worlds, const std::vector<uint64_t>& seeds,
                        const std::optional<std::vector<uint32_t>>& variants,
                        const std::optional<PoolAccess::OwnValues>& values) {
  const PoolAccess::OwnValues own = values.value_or(PoolAccess::OwnValues{nullptr, 0});
  const uint32_t variant = variants && !worlds.empty() ? (*variants)[0] : pool_.Variant(0);
  const bool is_another = variant != pool_.Variant(0);
  const auto is_other = [&](uint32_t each) { return each != variant; };
  if ((variants && std::ranges::any_of(*variants, is_other)) ||
      (is_another && worlds.size() < pool_.size()))
    throw Failure{Kind::kStage, "all worlds on a device must be of the same variant"};
  const bool is_all = worlds.size() == pool_.size();
  WithDevice([&] {
    if (is_another || (is_all && !PoolAccess::OnDevice(pool_))) {
      PoolAccess::ResetToVariant(pool_, variant, {worlds.begin(), worlds.end()}, seeds, own);
    } else {
      Rows();
      PoolAccess::ResetOnDevice(pool_, worlds, seeds, own);
    }
    PlanIfNew();
    rows::RowDevice& device = Rows()->device();
    if (Member* const commands = Commands()) {
      WaitForClients();
      const auto words = static_cast<uint32_t>(3 * size());
      device.Clear(commands->memory.get(), ChoiceOf(worlds), words);
      if (commands->host.exists())
        for (const uint32_t world : worlds)
          std::fill_n(static_cast<double*>(commands->host.data()) + world * words, words, 0.0);
    }
  });
  if (is_all) has_stepped_ = false;
  for (const auto& member : members_)
    if (is_all && member->lacks_models && !member->IsCommands()) Subscribe(member->plan);
  Gather(members_, ChoiceOf(worlds));
}

void DeviceCrowd::CarryToVariant(uint32_t variant, const PoolAccess::OwnValues& values) {
  Rows();
  const std::string why =
      WithDevice([&] { return PoolAccess::CarryToVariant(pool_, variant, values); });
  if (!why.empty()) throw Failure{Kind::kStage, "other properties can't vary, because " + why};
  PlanIfNew();
  Gather(members_);
}

void DeviceCrowd::ResetFlagged(const rows::RowInput& flags) {
  WithDevice([&] {
    rows::RowDevice& device = Rows()->device();
    WaitForClients();
    device.ResetFlagged(flags);
    PoolAccess::NoteDeviceSteps(pool_);
    if (Member* const commands = Commands())
      device.Clear(commands->memory.get(), rows::RowChoice(flags),
                   static_cast<uint32_t>(3 * size()));
  });
  Gather(members_, rows::RowChoice(flags));
}

void DeviceCrowd::Teleport(const rows::RowInput& poses, const rows::RowInput& which) {
  std::vector<row_entry_t> entries;
  const RowRobots& robots = Robots();
  for (uint32_t i = 0; i < size(); i++)
    if (robots.movers[i] != RowRobots::kNone) entries.push_back({i, robots.movers[i]});
  WithDevice([&] {
    rows::RowDevice& device = Rows()->device();
    WaitForClients();
    device.Place(entries, static_cast<uint32_t>(size()), poses, which);
    PoolAccess::NoteDeviceSteps(pool_);
  });
  Gather(members_);
}

// ---- arrays of CUDA -----------------------------------------------------------------------------

nb::object DeviceArray::Shape() const {
  nb::list lengths;
  for (const size_t length : member_->shape) lengths.append(length);
  return nb::tuple(lengths);
}

const char* DeviceArray::DtypeName() const { return member_->flags ? "bool" : "float64"; }

nb::object DeviceArray::Dlpack(const nb::kwargs&) const {
  using Memory = std::shared_ptr<rows::RowMemory>;
  const nb::capsule owner(new Memory(member_->memory),
                          [](void* held) noexcept { delete static_cast<Memory*>(held); });
  return nb::cast(nb::ndarray<>(member_->memory->cuda_address(), member_->shape.size(),
                                member_->shape.data(), owner, nullptr, member_->Dtype(),
                                nb::device::cuda::value, member_->memory->cuda_device()));
}

nb::tuple DeviceArray::DlpackDevice() const {
  return nb::make_tuple(nb::device::cuda::value, member_->memory->cuda_device());
}

nb::object DeviceArray::Numpy() const {
  const DeviceCrowd::Lock lock(*crowd_);
  auto copy = std::make_unique<Array>();
  copy->Make(member_->shape, member_->Dtype());
  WithDevice([&] {
    const GilRelease no_gil;
    rows::RowDevice& device = crowd_->Rows()->device();
    device.WaitForCuda();
    device.ReadMemory(member_->memory.get(), copy->data(), member_->memory->bytes());
  });
  const Array& array = *copy;
  const nb::capsule owner(copy.release(),
                          [](void* held) noexcept { delete static_cast<Array*>(held); });
  return nb::cast(nb::ndarray<nb::numpy>(array.data(), array.shape().size(), array.shape().data(),
                                         owner, nullptr, array.dtype()));
}

void DeviceArray::Write(const nb::ndarray<const double, nb::c_contig, nb::device::cpu>& from) {
  if (!member_->IsCommands())
    throw Failure{Kind::kStage, "the array " + member_->name + " can't be written; cmd can"};
  if (from.nbytes() != member_->memory->bytes())
    throw nb::value_error("found another number of elements than the array has");
  const DeviceCrowd::Lock lock(*crowd_);
  WithDevice([&] {
    const GilRelease no_gil;
    rows::RowDevice& device = crowd_->Rows()->device();
    device.WaitForCuda();
    device.WriteMemory(member_->memory.get(), from.data());
  });
}

}  // namespace Stg::python
