// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_LEXER_HH
#define STAGE_WORLDFILE_LEXER_HH

#include <cstdint>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "worldfile/document.hh"

namespace Stg::worldfile {

/// Reads a whole file. Throws LoadError ("NAME: REASON") if it is a directory, unreadable or larger
/// than kMaxTextBytes. Blocks only on pipes, for their writer.
std::string ReadWholeFile(const std::string& path);

/// Splits the world file (source 0 of the document) or another source into tokens. Tokens of
/// included files replace their include line. The last token is kEnd.
class Lexer {
 public:
  /// Relative includes are searched in `base_directory`. Reports "[Include NAME]" as progress for
  /// each include.
  Lexer(Document& document, std::string base_directory);

  void Run(std::uint16_t source = 0);
  /// Appends the tokens of another source, without kEnd.
  void LexText(std::uint16_t source) { LexSource(source); }

 private:
  struct Cursor {
    std::uint16_t source;
    std::string_view text;
    std::size_t at = 0;
  };

  void LexSource(std::uint16_t source);
  void CheckEncoding(std::uint16_t source) const;
  void LexToken(Cursor& cursor);
  void LexWord(Cursor& cursor);
  void LexNumber(Cursor& cursor);
  [[noreturn]] void FailNumber(const Cursor& cursor, std::size_t start) const;
  void LexString(Cursor& cursor);
  void LexInclude(Cursor& cursor, std::size_t word);
  std::string IncludeName(Cursor& cursor, std::size_t word) const;
  void SkipRestOfLine(Cursor& cursor);
  std::uint16_t OpenInclude(const Cursor& cursor, std::size_t quote, const std::string& name);
  void CheckCycle(const Cursor& cursor, std::size_t quote, const std::string& key) const;
  void Push(const Cursor& cursor, std::size_t start, TokenKind kind);

  Document& document_;
  std::string base_directory_;
  std::vector<std::uint16_t> open_;  // the file being read, preceded by the files that include it
  std::size_t includes_ = 0;
  std::size_t bytes_ = 0;
  bool gap_ = true;
};

}  // namespace Stg::worldfile

#endif
