// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/source.hh"

#include <algorithm>
#include <utility>

#include "geometry/load_error.hh"
#include "worldfile/characters.hh"

namespace Stg::worldfile {
namespace {

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";  // UTF-8

}  // namespace

std::string Place::Text() const {
  return file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

std::size_t LineEndLength(std::string_view text, std::size_t at) {
  if (at >= text.size() || !IsLineEnd(text[at])) return 0;
  const bool pair = at + 1 < text.size() && IsLineEnd(text[at + 1]) && text[at + 1] != text[at];
  return pair ? 2 : 1;
}

std::uint32_t SourceSet::Add(std::string name, std::string key, std::string text) {
  const std::size_t start = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0;
  sources_.push_back({std::move(name), std::move(key), std::move(text), start, {}});
  return static_cast<std::uint32_t>(sources_.size() - 1);
}

int SourceSet::Find(std::string_view key) const {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (sources_[i].key == key) return static_cast<int>(i);
  }
  return -1;
}

// Advances a mark to the line that contains `offset`.
SourceSet::Mark SourceSet::Advance(std::string_view text, Mark from, std::size_t offset) {
  while (from.offset < offset) {
    const std::size_t length = LineEndLength(text, from.offset);
    if (length > 0 && from.offset + length > offset) break;  // between CR and LF
    from.offset += std::max<std::size_t>(length, 1);
    if (length > 0) {
      ++from.line;
      from.line_start = from.offset;
    }
  }
  return from;
}

std::vector<SourceSet::Mark> SourceSet::MakeMarks(const Source& source) {
  constexpr std::size_t kDistance = 4096;
  const std::string_view text = source.text;
  std::vector<Mark> marks{{source.start, 1, source.start}};
  while (marks.back().offset + kDistance < text.size()) {
    marks.push_back(Advance(text, marks.back(), marks.back().offset + kDistance));
  }
  return marks;
}

Place SourceSet::PlaceOf(std::uint32_t source, std::size_t offset) const {
  const Source& from = sources_[source];
  if (from.marks.empty()) from.marks = MakeMarks(from);
  const auto after =
      std::upper_bound(from.marks.begin(), from.marks.end(), offset,
                       [](std::size_t wanted, const Mark& mark) { return wanted < mark.offset; });
  const Mark mark = Advance(from.text, *(after - 1), offset);
  return {from.name, mark.line, offset - mark.line_start + 1};
}

void SourceSet::Fail(std::uint32_t source, std::size_t offset, const std::string& message) const {
  throw LoadError(PlaceOf(source, offset).Text() + ": " + message);
}

}  // namespace Stg::worldfile
