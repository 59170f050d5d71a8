// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_SOURCE_HH
#define STAGE_WORLDFILE_SOURCE_HH

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

namespace Stg::worldfile {

/// A place in a file: line and column count from 1, columns in bytes (a TAB is one).
struct Place {
  std::string file;
  std::size_t line = 1;
  std::size_t column = 1;

  /// "FILE:LINE:COLUMN"
  std::string Text() const;
};

/// The length of the line end at text[at]: 2 for CR LF and LF CR, 1 for LF or CR alone, else 0.
std::size_t LineEndLength(std::string_view text, std::size_t at);

/// The texts that make up a world: source 0 is the world file, the others are what it includes.
class SourceSet {
 public:
  /// Adds a text. `name` is what messages call it, `key` tells files apart.
  std::uint32_t Add(std::string name, std::string key, std::string text);

  /// The number of the source with this key, or -1.
  int Find(std::string_view key) const;

  std::string_view Text(std::uint32_t source) const { return sources_[source].text; }
  /// Where it begins: behind a byte order mark, from where the columns of its first line count.
  std::size_t Start(std::uint32_t source) const { return sources_[source].start; }
  const std::string& Name(std::uint32_t source) const { return sources_[source].name; }
  std::size_t Count() const { return sources_.size(); }

  Place PlaceOf(std::uint32_t source, std::size_t offset) const;

  /// Throws LoadError with "FILE:LINE:COLUMN: message".
  [[noreturn]] void Fail(std::uint32_t source, std::size_t offset,
                         const std::string& message) const;

 private:
  struct Mark {
    std::size_t offset = 0;
    std::size_t line = 1;
    std::size_t line_start = 0;
  };
  struct Source {
    std::string name;
    std::string key;
    std::string text;
    std::size_t start = 0;
    mutable std::vector<Mark> marks;  // every few kilobytes; made when first asked for
  };

  static Mark Advance(std::string_view text, Mark from, std::size_t offset);
  static std::vector<Mark> MakeMarks(const Source& source);

  std::deque<Source> sources_;  // a deque, so that texts stay where they are
};

}  // namespace Stg::worldfile

#endif
