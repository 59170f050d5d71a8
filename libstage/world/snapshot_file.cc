// SPDX-License-Identifier: GPL-2.0-or-later
//
// Snapshot files. All numbers are little-endian:
//
//   8 bytes   kMagic
//   u32       version of the format and of the state
//   u64       simulated time, microseconds
//   u64       size in bytes of the rest, without the checksum
//   u32       number of sections of the state, see state_row.hh
//   u32[]     end of each section, in bytes from the start of the first
//   bytes     the sections
//   u64       checksum of all the above (FNV-1a)

#include <algorithm>
#include <cstring>
#include <istream>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "messages/report.hh"
#include "random/fnv1a.hh"
#include "world/snapshot.hh"
#include "world/state_row.hh"

namespace Stg {

const char Snapshot::kMagic[9] = "STGSNAP\n";

namespace {

using Bytes = StateExchange::Bytes;

/// Increment it when the state of a class gets other fields or another order.
constexpr uint64_t kVersion = 5;
constexpr size_t kMagicSize = sizeof(Snapshot::kMagic) - 1;
constexpr size_t kHeadSize = kMagicSize + 4 + 8 + 8, kChecksumSize = 8;

void Append(Bytes* to, uint64_t number, size_t bytes) {
  for (size_t i = 0; i < bytes; i++)
    to->push_back(static_cast<unsigned char>(number >> 8 * i & 0xff));
}

uint64_t NumberAt(const Bytes& from, size_t place, size_t bytes) {
  uint64_t number = 0;
  for (size_t i = 0; i < bytes; i++) number |= uint64_t{from[place + i]} << 8 * i;
  return number;
}

/// Reads up to `size` bytes. Allocates as data arrives: the size in the file may be wrong.
Bytes ReadBytes(std::istream* in, uint64_t size) {
  constexpr uint64_t kPiece = 1 << 16;
  Bytes bytes;
  while (bytes.size() < size && *in) {
    const size_t before = bytes.size();
    const size_t piece = static_cast<size_t>(std::min(kPiece, size - before));
    bytes.resize(before + piece);
    in->read(reinterpret_cast<char*>(bytes.data()) + before, static_cast<std::streamsize>(piece));
    bytes.resize(before + static_cast<size_t>(in->gcount()));
  }
  return bytes;
}

Bytes ToBytes(const StateRow& row) {
  Bytes bytes;
  if (row.count() == 0) return bytes;
  Append(&bytes, row.count(), 4);
  for (const uint32_t end : row.ends) Append(&bytes, end, 4);
  bytes.insert(bytes.end(), row.bytes.begin(), row.bytes.end());
  return bytes;
}

/// Returns false if the sections are not contiguous up to the end.
bool FromBytes(const Bytes& bytes, StateRow* row) {
  if (bytes.size() < 4) return false;
  const uint64_t count = NumberAt(bytes, 0, 4);
  if (count == 0 || count > bytes.size() / 4 - 1) return false;
  const size_t first = 4 + 4 * static_cast<size_t>(count);
  uint32_t before = 0;
  for (size_t i = 4; i < first; i += 4) {
    const auto end = static_cast<uint32_t>(NumberAt(bytes, i, 4));
    if (end < before) return false;
    row->ends.push_back(before = end);
  }
  row->bytes.assign(bytes.begin() + static_cast<std::ptrdiff_t>(first), bytes.end());
  return before == row->bytes.size();
}

bool Refuse(const std::string& name, const std::string& found, const std::string& expected) {
  messages::Report(LogLevel::kError,
                   "stage: " + name + ": found " + found + ", expected " + expected);
  return false;
}

uint64_t Checksum(const Bytes& head, const Bytes& state) {
  return Fnv1a(state.data(), state.size(), Fnv1a(head.data(), head.size()));
}

}  // namespace

bool Snapshot::Write(std::ostream& out) const {
  StateRow buffer;
  const Bytes state = empty() ? Bytes() : ToBytes(Row(&buffer));
  Bytes head(kMagic, kMagic + kMagicSize), checksum;
  Append(&head, kVersion, 4);
  Append(&head, time_, 8);
  Append(&head, state.size(), 8);
  Append(&checksum, Checksum(head, state), kChecksumSize);
  for (const Bytes* part :
       {static_cast<const Bytes*>(&head), &state, static_cast<const Bytes*>(&checksum)})
    out.write(reinterpret_cast<const char*>(part->data()),
              static_cast<std::streamsize>(part->size()));
  return static_cast<bool>(out.flush());
}

bool Snapshot::Read(std::istream& in, const std::string& name) {
  const Bytes head = ReadBytes(&in, kHeadSize);
  if (head.size() < kMagicSize || std::memcmp(head.data(), kMagic, kMagicSize) != 0)
    return Refuse(name, "something else", "a snapshot, as stage --save-snapshot writes it");
  if (head.size() < kHeadSize)
    return Refuse(name, "an end after " + std::to_string(head.size()) + " bytes",
                  "a whole snapshot");
  const uint64_t version = NumberAt(head, kMagicSize, 4);
  if (version != kVersion)
    return Refuse(name, "a snapshot of version " + std::to_string(version),
                  "version " + std::to_string(kVersion));
  const uint64_t size = NumberAt(head, kHeadSize - 8, 8);
  const Bytes state = ReadBytes(&in, size);
  const Bytes checksum = ReadBytes(&in, kChecksumSize);
  if (state.size() < size || checksum.size() < kChecksumSize)
    return Refuse(
        name,
        "an end after " + std::to_string(kHeadSize + state.size() + checksum.size()) + " bytes",
        "a state of " + std::to_string(size) + " bytes and its checksum");
  if (in.peek() != std::istream::traits_type::eof())
    return Refuse(name, "more than a snapshot", "its end");
  if (NumberAt(checksum, 0, 8) != Checksum(head, state))
    return Refuse(name, "a checksum that is wrong", "a file as it was written");
  auto row = std::make_shared<StateRow>();
  if (size > 0 && !FromBytes(state, row.get()))
    return Refuse(name, "sections that don't fit", "a file as it was written");
  time_ = NumberAt(head, kMagicSize + 4, 8);
  is_from_file_ = true;
  row_ = size > 0 ? std::move(row) : nullptr;
  difference_.reset();
  return true;
}

}  // namespace Stg
