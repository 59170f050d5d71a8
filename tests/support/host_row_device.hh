// SPDX-License-Identifier: GPL-2.0-or-later
//
// A device that steps rows by the kernels' text, compiled for the host. It has one work-item.

#ifndef STAGE_TESTS_SUPPORT_HOST_ROW_DEVICE_HH
#define STAGE_TESTS_SUPPORT_HOST_ROW_DEVICE_HH

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "kernels/row_arrays.h"
#include "kernels/row_solve.h"
#include "rows/row_backend.hh"

namespace Stg::test {

class HostRowMemory : public rows::RowMemory {
 public:
  explicit HostRowMemory(size_t bytes) : RowMemory(bytes), words(bytes / sizeof(uint64_t) + 1, 0) {}
  row_byte* data() { return reinterpret_cast<row_byte*>(words.data()); }

  std::vector<uint64_t> words;
  std::vector<rows::RowPart> parts;
};

class HostRowDevice : public rows::RowDevice {
 public:
  std::string Name() const override { return "host"; }
  std::unique_ptr<rows::RowDevice> Another() const override {
    return std::make_unique<HostRowDevice>();
  }
  void Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) override {
    image_.assign(image.begin(), image.end());
    worlds_ = buffers.worlds;
    state_.assign(buffers.state_bytes / sizeof(uint64_t) + 1, 0);
    scratch_.assign(buffers.scratch_bytes / sizeof(uint64_t) + 1, 0);
  }
  void Write(size_t offset, const void* from, size_t bytes) override {
    std::memcpy(state() + offset, from, bytes);
  }
  void Read(size_t offset, void* to, size_t bytes) override {
    std::memcpy(to, state() + offset, bytes);
  }
  void Step(uint32_t steps, uint32_t unseen) override {
    std::vector<uint32_t> all(worlds_);
    std::iota(all.begin(), all.end(), 0u);
    StepWorlds(all, steps, unseen);
  }
  void StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) override {
    StepWorlds(worlds, steps, unseen);
  }
  void Reset(std::span<const uint32_t> worlds, std::span<const std::byte> given,
             uint64_t columns) override {
    for (size_t i = 0; i < worlds.size(); i++) {
      const row_world_t world = WorldAt(worlds[i]);
      row_reset(
          &world,
          reinterpret_cast<const row_byte*>(given.data()) + i * (given.size() / worlds.size()),
          columns);
    }
  }
  void Restore(std::span<const uint32_t> worlds, const rows::RowStarts& starts,
               std::span<const std::byte> given, uint64_t columns) override {
    for (size_t i = 0; i < worlds.size(); i++) {
      const row_world_t world = WorldAt(worlds[i]);
      row_restore(
          &world,
          reinterpret_cast<const row_byte*>(starts.states.data()) +
              starts.of_world[i] * starts.bytes,
          reinterpret_cast<const row_byte*>(given.data()) + i * (given.size() / worlds.size()),
          columns, 0);
    }
  }
  void Give(std::span<const row_given_t> commands) override {
    for (const row_given_t& given : commands) {
      const row_world_t world = WorldAt(given.world);
      row_give(&world, given);
    }
  }
  void Finish() override {}
  std::shared_ptr<rows::RowMemory> MakeMemory(size_t bytes) override {
    return std::make_shared<HostRowMemory>(bytes);
  }
  void SetParts(rows::RowMemory* memory, const std::vector<rows::RowPart>& parts) override {
    static_cast<HostRowMemory*>(memory)->parts = parts;
  }
  void Gather(rows::RowMemory* memory, const rows::RowChoice& worlds, size_t offset) override {
    auto* const to = static_cast<HostRowMemory*>(memory);
    for (const rows::RowPart& part : to->parts)
      for (const uint32_t i : Chosen(worlds))
        for (const row_entry_t& entry : part.entries) {
          const row_world_t world = WorldAt(i);
          row_gather(&world, &part.array, entry,
                     reinterpret_cast<const uint64_t*>(part.values.data()), to->data() + offset);
        }
  }
  void GiveCommands(rows::RowMemory* memory, const rows::RowChoice& worlds) override {
    auto* const from = static_cast<HostRowMemory*>(memory);
    for (const rows::RowPart& part : from->parts)
      for (const uint32_t i : Chosen(worlds))
        for (const row_entry_t& entry : part.entries) {
          const row_world_t world = WorldAt(i);
          row_command(&world, &part.array, entry, from->words.data());
        }
  }
  void Clear(rows::RowMemory* memory, const rows::RowChoice& worlds,
             uint32_t words_per_world) override {
    for (const uint32_t i : Chosen(worlds))
      std::fill_n(&static_cast<HostRowMemory*>(memory)->words[size_t{i} * words_per_world],
                  words_per_world, uint64_t{0});
  }
  void Place(const std::vector<row_entry_t>& entries, uint32_t robots, const rows::RowInput& poses,
             const rows::RowInput& chosen) override {
    for (size_t i = 0; i < worlds_; i++) {
      const row_world_t world = WorldAt(i);
      row_place(&world, entries.data(), static_cast<uint32_t>(entries.size()), robots,
                static_cast<const uint64_t*>(poses.data),
                static_cast<const row_byte*>(chosen.data));
    }
  }
  void ResetFlagged(const rows::RowInput& flags) override {
    for (size_t i = 0; i < worlds_; i++) {
      const row_world_t world = WorldAt(i);
      if (static_cast<const row_byte*>(flags.data)[i]) row_reset_again(&world);
    }
  }
  void WriteMemory(rows::RowMemory* memory, const void* from) override {
    std::memcpy(static_cast<HostRowMemory*>(memory)->data(), from, memory->bytes());
  }
  void ReadMemory(rows::RowMemory* memory, void* to, size_t bytes) override {
    std::memcpy(to, static_cast<HostRowMemory*>(memory)->data(), bytes);
  }
  void WaitForCuda() override {}

  /// Numbers of islands that were solved, by kind, of all such devices.
  inline static std::array<uint64_t, ROW_ISLAND_KINDS> islands{};
  inline static uint64_t worlds_in_shared_room = 0;

 private:
  void StepWorlds(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) {
    if (!rows::HasOutlines(image_)) {
      for (const uint32_t i : worlds) {
        const row_world_t world = WorldAt(i);
        row_step_cells(&world, steps, unseen);
      }
      return;
    }
    for (uint32_t left = steps; left-- > 0;) StepOutlines(worlds, unseen + left);
  }
  void StepOutlines(std::span<const uint32_t> worlds, uint32_t unseen) {
    for (const uint32_t i : worlds) {
      const row_world_t world = WorldAt(i);
      row_begin_outlines(&world, unseen);
    }
    const row_world_t first = WorldAt(0);
    row_solve_small_islands(&first, ROW_SMALL_KINDS, 1, 0, 1);
    row_solve_small_islands(&first, 1u << ROW_SLOW, 0, 0, 1);
    row_solve_large_islands(&first, 0, 1);
    CountIslands(first);
    row_forget_waiting(&first);
    for (const uint32_t i : worlds) {
      const row_world_t world = WorldAt(i);
      row_end_outlines(&world);
    }
  }
  void CountIslands(const row_world_t& w) {
    for (uint32_t kind = 0; kind < ROW_ISLAND_KINDS; kind++)
      islands[kind] += *row_waiting_count(&w, kind);
    for (uint32_t i = 0; i < *row_waiting_count(&w, ROW_LARGE); i++)
      worlds_in_shared_room += (row_waiting(&w, ROW_LARGE)[i].island & ROW_ALL_OF) != 0;
  }
  row_byte* state() { return reinterpret_cast<row_byte*>(state_.data()); }
  std::vector<uint32_t> Chosen(const rows::RowChoice& worlds) const {
    std::vector<uint32_t> chosen(worlds.list.begin(), worlds.list.end());
    for (uint32_t i = 0; worlds.kind != ROW_LISTED_WORLDS && i < worlds_; i++)
      if (worlds.kind == ROW_ALL_WORLDS || static_cast<const row_byte*>(worlds.flags.data)[i])
        chosen.push_back(i);
    return chosen;
  }
  row_world_t WorldAt(size_t i) {
    const auto* const image = reinterpret_cast<const row_byte*>(image_.data());
    const auto* const scene = reinterpret_cast<const row_scene_t*>(image);
    return {image, scene, state(),
            reinterpret_cast<row_byte*>(scratch_.data()) + i * scene->scratch_bytes, i};
  }

  std::vector<uint64_t> image_, state_, scratch_;
  size_t worlds_ = 0;
};

/// A device that is lost at some call, after which all calls fail.
class LostRowDevice final : public HostRowDevice {
 public:
  /// `calls`: number of calls that it answers, those of all its copies together.
  explicit LostRowDevice(std::shared_ptr<int> calls) : calls_(std::move(calls)) {}

  std::unique_ptr<rows::RowDevice> Another() const override {
    return std::make_unique<LostRowDevice>(calls_);
  }
  void Begin(std::span<const uint64_t> image, const rows::RowBuffers& buffers) override {
    Count();
    HostRowDevice::Begin(image, buffers);
  }
  void Write(size_t offset, const void* from, size_t bytes) override {
    Count();
    HostRowDevice::Write(offset, from, bytes);
  }
  void Read(size_t offset, void* to, size_t bytes) override {
    Count();
    HostRowDevice::Read(offset, to, bytes);
  }
  void StepSome(std::span<const uint32_t> worlds, uint32_t steps, uint32_t unseen) override {
    Count();
    HostRowDevice::StepSome(worlds, steps, unseen);
  }
  void Restore(std::span<const uint32_t> worlds, const rows::RowStarts& starts,
               std::span<const std::byte> given, uint64_t columns) override {
    Count();
    HostRowDevice::Restore(worlds, starts, given, columns);
  }
  void Give(std::span<const row_given_t> commands) override {
    Count();
    HostRowDevice::Give(commands);
  }
  void ReadMemory(rows::RowMemory* memory, void* to, size_t bytes) override {
    Count();
    HostRowDevice::ReadMemory(memory, to, bytes);
  }
  void Finish() override { Count(); }

 private:
  void Count() {
    if (--*calls_ < 0) throw rows::RowDeviceError("the device is lost");
  }

  const std::shared_ptr<int> calls_;
};

}  // namespace Stg::test

#endif
