// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_PARSER_HH
#define STAGE_WORLDFILE_PARSER_HH

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "worldfile/document.hh"
#include "worldfile/expander.hh"

namespace Stg::worldfile {

/// Turns the document's tokens into its entities:
///
///     file     := { macro | entity | property }
///     macro    := 'define' NAME BASE '(' body ')'
///     entity   := NAME '(' body ')'
///     body     := { entity | property }
///     property := NAME ( number | string | '[' { number | string } ']' )
///
/// An entity of the world is expanded as soon as it is read, using the macros defined so far.
/// Throws LoadError.
class Parser {
 public:
  explicit Parser(Document& document) : document_(document), expander_(document) {}

  void ParseFile();
  /// Reads macros from the token `first` on, where anything else is an error.
  void ParseDefinitions(std::uint32_t first);

  /// Holds the macros of the file.
  Expander& expander() { return expander_; }

 private:
  const Token& Peek() const { return document_.tokens[next_]; }
  const Token& Previous() const { return document_.tokens[next_ - 1]; }
  bool At(TokenKind kind) const { return Peek().kind == kind; }
  bool AtWord(const char* word) const;

  void ParseDefine();
  std::uint32_t ParseDefineHead(std::uint32_t define);
  void ParseMacroBody(Macro& macro, std::uint32_t open);
  void AddMacro(std::uint32_t name_token, std::uint32_t base_token, std::uint32_t open);
  std::uint32_t FindClose(std::uint32_t open) const;

  void ParseItem(std::size_t depth);
  Child ParseChild(std::uint32_t name_token, std::size_t depth);
  std::uint32_t ParseBody(std::size_t depth);
  void ParseProperty(std::uint32_t name_token);
  void ParseTuple(Property& property);
  void CloseBody(std::uint32_t body, std::size_t first_property, std::size_t first_child);
  void StoreProperties(Body& body, std::size_t first);

  std::uint32_t Name(std::uint32_t token);
  std::string Describe(const Token& token) const;
  [[noreturn]] void Fail(const Token& token, const std::string& expected) const;
  [[noreturn]] void FailAtGap(const std::string& expected) const;
  [[noreturn]] void FailUnclosed(const Token& open) const;
  std::string BlankHint() const;

  Document& document_;
  Expander expander_;
  std::uint32_t next_ = 0;
  bool in_macro_ = false;
  std::uint32_t last_name_ = kNone;  // token of the last property's name
  // Contents of the bodies still open, those of the innermost at the end. Deques, because a body
  // may be large and a vector doubles when it grows.
  std::deque<Property> open_properties_;
  std::deque<Child> open_children_;
};

}  // namespace Stg::worldfile

#endif
