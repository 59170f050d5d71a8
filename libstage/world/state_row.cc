// SPDX-License-Identifier: GPL-2.0-or-later
//
// Encoding of a difference: the total number of sections, then for each section that differs the
// number of equal sections before it, followed by 0 and its changes, or by its size + 1 and all its
// bytes. Changes are intervals: number of bytes, number of equal bytes before them, the bytes; a
// length of 0 ends the list. Numbers are encoded in LEB128 (seven bits per byte), as in DWARF.

#include "world/state_row.hh"

#include <algorithm>
#include <cstring>

namespace Stg {

namespace {

using Bytes = StateRow::Bytes;
using Section = std::span<const unsigned char>;

void Append(Bytes* to, std::size_t number) {
  for (; number >= 0x80; number >>= 7) to->push_back(static_cast<unsigned char>(number | 0x80));
  to->push_back(static_cast<unsigned char>(number));
}

std::size_t TakeNumber(Section* from) {
  std::size_t number = 0, place = 0;
  for (int shift = 0;; shift += 7) {
    const unsigned char byte = (*from)[place++];
    number |= std::size_t{byte & 0x7fu} << shift;
    if (byte < 0x80) break;
  }
  *from = from->subspan(place);
  return number;
}

/// First index from `i` on at which `a` and `b` differ, or their size.
std::size_t NextDifference(Section a, Section b, std::size_t i) {
  for (; i + 8 <= a.size(); i += 8)
    if (std::memcmp(&a[i], &b[i], 8) != 0) break;
  while (i < a.size() && a[i] == b[i]) i++;
  return i;
}

/// End of the interval of differing bytes that starts at `i`. It includes gaps of up to two equal
/// bytes, since starting a new interval would take more.
std::size_t EndOfRun(Section a, Section b, std::size_t i) {
  for (;;) {
    while (i < a.size() && a[i] != b[i]) i++;
    const std::size_t next = NextDifference(a, b, i);
    if (next == a.size() || next - i > 2) return i;
    i = next;
  }
}

/// Encodes the changes between two sections of equal size.
void AppendRuns(Section base, Section section, Bytes* to) {
  std::size_t done = 0;
  for (;;) {
    const std::size_t from = NextDifference(base, section, done);
    if (from == section.size()) return Append(to, 0);
    const std::size_t end = EndOfRun(base, section, from);
    Append(to, end - from);
    Append(to, from - done);
    to->insert(to->end(), section.begin() + static_cast<std::ptrdiff_t>(from),
               section.begin() + static_cast<std::ptrdiff_t>(end));
    done = end;
  }
}

void TakeRuns(Section* from, unsigned char* section) {
  while (const std::size_t size = TakeNumber(from)) {
    section += TakeNumber(from);
    std::copy_n(from->data(), size, section);
    section += size;
    *from = from->subspan(size);
  }
}

void AppendSection(StateRow* row, Section section) {
  row->bytes.insert(row->bytes.end(), section.begin(), section.end());
  row->ends.push_back(static_cast<uint32_t>(row->bytes.size()));
}

/// Appends the sections of `base` in [first, end).
void AppendSections(StateRow* row, const StateRow& base, std::size_t first, std::size_t end) {
  if (first == end) return;
  const uint32_t begin = first > 0 ? base.ends[first - 1] : 0;
  const uint32_t shift = static_cast<uint32_t>(row->bytes.size()) - begin;
  row->bytes.insert(row->bytes.end(), base.bytes.begin() + begin,
                    base.bytes.begin() + base.ends[end - 1]);
  for (std::size_t i = first; i < end; i++) row->ends.push_back(base.ends[i] + shift);
}

}  // namespace

bool SameBytes(std::span<const unsigned char> a, std::span<const unsigned char> b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size()) == 0);
}

void AppendDifference(const StateRow& base, const StateRow& row, Bytes* difference) {
  Append(difference, row.count());
  std::size_t done = 0;
  for (std::size_t i = 0; i < row.count(); i++) {
    const Section section = row.section(i),
                  of_base = i < base.count() ? base.section(i) : Section();
    if (i < base.count() && SameBytes(section, of_base)) continue;
    Append(difference, i - done);
    done = i + 1;
    if (i < base.count() && section.size() == of_base.size()) {
      Append(difference, 0);
      AppendRuns(of_base, section, difference);
    } else {
      Append(difference, section.size() + 1);
      difference->insert(difference->end(), section.begin(), section.end());
    }
  }
}

void Patch(const StateRow& base, Section difference, StateRow* row) {
  row->Clear();
  row->fit = base.fit;
  const std::size_t count = TakeNumber(&difference);
  while (!difference.empty()) {
    const std::size_t next = row->count() + TakeNumber(&difference);
    AppendSections(row, base, row->count(), next);
    if (const std::size_t size = TakeNumber(&difference); size > 0) {
      AppendSection(row, difference.first(size - 1));
      difference = difference.subspan(size - 1);
    } else {
      AppendSections(row, base, next, next + 1);
      TakeRuns(&difference, row->bytes.data() + row->bytes.size() - base.section(next).size());
    }
  }
  AppendSections(row, base, row->count(), count);
}

}  // namespace Stg
