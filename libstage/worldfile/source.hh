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

/// A place in a file. Lines and columns count from 1, columns in bytes (a TAB is one).
struct Place {
  std::string file;
  std::size_t line = 1;
  std::size_t column = 1;

  /// "FILE:LINE:COLUMN"
  std::string Text() const;
};

/// Length of the line end at text[at]: 2 for CR LF and LF CR, 1 for a single LF or CR, otherwise 0.
std::size_t LineEndLength(std::string_view text, std::size_t at);

/// The texts of a world: source 0 is the world file, the others are included files.
class SourceSet {
 public:
  /// Adds a text. `name` is used in messages, `key` identifies the file.
  std::uint32_t Add(std::string name, std::string key, std::string text);

  /// Number of the source with this key, or -1.
  int Find(std::string_view key) const;

  std::string_view Text(std::uint32_t source) const { return sources_[source].text; }
  /// Offset after the byte order mark, if any. Columns of the first line count from it.
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
    mutable std::vector<Mark> marks;  // every few kilobytes; made on first use
  };

  static Mark Advance(std::string_view text, Mark from, std::size_t offset);
  static std::vector<Mark> MakeMarks(const Source& source);

  std::deque<Source> sources_;  // a deque keeps the texts in place
};

}  // namespace Stg::worldfile

#endif
