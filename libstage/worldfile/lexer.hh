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

/// Reads a whole file. Throws LoadError ("NAME: REASON") if it is a directory, cannot be read or
/// is larger than kMaxTextBytes. Waits for nothing but a pipe's writer.
std::string ReadWholeFile(const std::string& path);

/// Turns the world file (source 0 of the document) into tokens. The tokens of an included file
/// stand where its include line is. Ends with one kEnd token at the end of the world file.
class Lexer {
 public:
  /// `base_directory` is where relative includes are looked for. `progress` (may be null) gets
  /// "[Include NAME]" for each include.
  Lexer(Document& document, std::string base_directory);

  void Run();
  /// Adds the tokens of another source, without a kEnd.
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
  std::vector<std::uint16_t> open_;  // the file being read, the ones that include it before it
  std::size_t includes_ = 0;
  std::size_t bytes_ = 0;
  bool gap_ = true;
};

}  // namespace Stg::worldfile

#endif
