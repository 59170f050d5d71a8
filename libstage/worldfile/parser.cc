// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/parser.hh"

#include <algorithm>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"

namespace Stg::worldfile {
namespace {

bool IsValue(TokenKind kind) { return kind == TokenKind::kNumber || kind == TokenKind::kString; }

// Reserves memory for large additions only; small ones grow by doubling.
template <typename T>
void ReserveFor(std::vector<T>& list, std::size_t more) {
  if (more > list.size()) list.reserve(list.size() + more);
}

}  // namespace

void Parser::ParseFile() {
  while (!At(TokenKind::kEnd)) {
    if (!At(TokenKind::kWord)) Fail(Peek(), "the name of an entity, of a property or of a macro");
    if (AtWord("define")) {
      ParseDefine();
      continue;
    }
    ParseItem(1);
    if (!open_children_.empty()) {
      expander_.Expand(open_children_.back());
      open_children_.clear();
    }
  }
  CloseBody(0, 0, 0);
  expander_.WarnOfUnusedErrors();
}

void Parser::ParseDefinitions(std::uint32_t first) {
  next_ = first;
  while (!At(TokenKind::kEnd)) {
    if (!AtWord("define")) Fail(Peek(), "'define', because the world has been loaded already");
    ParseDefine();
  }
}

bool Parser::AtWord(const char* word) const {
  return At(TokenKind::kWord) && document_.Text(Peek()) == word;
}

// ---- macros ----

void Parser::ParseDefine() {
  const std::uint32_t define = next_++;
  const std::uint32_t open = ParseDefineHead(define);
  AddMacro(define + 1, define + 2, open);
  next_ = FindClose(open) + 1;
}

// Reads `NAME BASE`. Returns the index of the parenthesis that follows.
std::uint32_t Parser::ParseDefineHead(std::uint32_t define) {
  std::uint32_t words = 0;
  while (At(TokenKind::kWord)) {
    if (++words > 2) Fail(Peek(), "'(' (extra tokens in macro definition)");
    ++next_;
  }
  if (At(TokenKind::kCloseParen)) {
    Fail(Peek(), "'(' before it (misplaced ')' in macro definition)");
  }
  if (At(TokenKind::kEnd)) FailUnclosed(document_.tokens[define]);
  if (!At(TokenKind::kOpenParen)) Fail(Peek(), "define NAME BASE (");
  if (words < 2) {
    document_.Fail(document_.tokens[define], "missing name in macro definition: found " +
                                                 std::string(words == 0 ? "no name" : "one name") +
                                                 " before '(', expected two, define NAME BASE (");
  }
  return next_;
}

// Adds a macro, unless one of that name exists.
void Parser::AddMacro(std::uint32_t name_token, std::uint32_t base_token, std::uint32_t open) {
  const std::uint32_t name = Name(name_token);
  const Macro* earlier = expander_.FindMacro(name);
  if (earlier != nullptr) {
    const Token& here = document_.tokens[name_token];
    const Token& first = document_.tokens[earlier->name_token];
    const bool same = here.source == first.source && here.offset == first.offset;
    if (same || document_.HasAllWarnings()) return;  // `same`: the file is included twice
    document_.Warn(here, "macro " + Quoted(document_.names.Text(name)) +
                             " is defined again; the first definition, at " +
                             document_.PlaceOf(first).Text() + ", stays");
    return;
  }
  if (document_.macros.size() >= kMaxMacros) {
    document_.Fail(document_.tokens[name_token],
                   "found more than " + std::to_string(kMaxMacros) + " macros, expected fewer");
  }
  Macro macro{name, Name(base_token), name_token, kNone, {}};
  ParseMacroBody(macro, open);
  expander_.AddMacro(std::move(macro));
}

// Errors in a macro's body are reported only if the macro is used, as in Stage 4.3.
void Parser::ParseMacroBody(Macro& macro, std::uint32_t open) {
  const std::size_t properties = open_properties_.size();
  const std::size_t children = open_children_.size();
  FindClose(open);  // a missing parenthesis is an immediate error
  next_ = open;
  in_macro_ = true;
  try {
    macro.body = ParseBody(1);
  } catch (const LoadError& error) {
    macro.error = error.what();
    macro.body = static_cast<std::uint32_t>(document_.bodies.size());
    document_.bodies.emplace_back();
    open_properties_.resize(properties);
    open_children_.resize(children);
  }
  in_macro_ = false;
}

std::uint32_t Parser::FindClose(std::uint32_t open) const {
  std::size_t depth = 0;
  for (std::uint32_t i = open;; ++i) {
    const TokenKind kind = document_.tokens[i].kind;
    if (kind == TokenKind::kEnd) FailUnclosed(document_.tokens[open]);
    if (kind == TokenKind::kOpenParen) ++depth;
    if (kind == TokenKind::kCloseParen && --depth == 0) return i;
  }
}

// ---- entities and properties ----

// Reads an entity or a property; the next token is a word.
void Parser::ParseItem(std::size_t depth) {
  const std::uint32_t name_token = next_++;
  if (At(TokenKind::kOpenParen)) {
    open_children_.push_back(ParseChild(name_token, depth));
  } else {
    ParseProperty(name_token);
  }
}

Child Parser::ParseChild(std::uint32_t name_token, std::size_t depth) {
  if (depth > kMaxNesting) {
    document_.Fail(
        document_.tokens[name_token],
        "found entities nested more than " + std::to_string(kMaxNesting) + " deep, expected fewer");
  }
  ++document_.written_entities;
  const std::uint32_t name = Name(name_token);
  return {name, name_token, ParseBody(depth)};
}

// Reads `( ... )`. Returns the number of the body.
std::uint32_t Parser::ParseBody(std::size_t depth) {
  const std::size_t first_property = open_properties_.size();
  const std::size_t first_child = open_children_.size();
  const auto body = static_cast<std::uint32_t>(document_.bodies.size());
  document_.bodies.emplace_back();
  const std::uint32_t open = next_++;
  while (!At(TokenKind::kCloseParen)) {
    if (At(TokenKind::kEnd)) FailUnclosed(document_.tokens[open]);
    if (!At(TokenKind::kWord)) {
      Fail(Peek(), "the name of an entity or of a property, or ')'" + BlankHint());
    }
    ParseItem(depth + 1);
  }
  document_.bodies[body].close_token = next_++;
  CloseBody(body, first_property, first_child);
  return body;
}

void Parser::ParseProperty(std::uint32_t name_token) {
  const bool tuple = At(TokenKind::kOpenBracket);
  if (!tuple && !IsValue(Peek().kind)) {
    const auto& name = document_.tokens[name_token];
    Fail(Peek(), "a number, a quoted string, '[' or '(' after " + Quoted(document_.Text(name)));
  }
  if (Peek().after_gap) FailAtGap("a value on the same line");
  Property property{Name(name_token), name_token, next_, 0, 0};
  last_name_ = name_token;
  if (tuple) {
    ParseTuple(property);
  } else {
    property.value_count = 1;
    ++next_;
  }
  open_properties_.push_back(property);
}

void Parser::ParseTuple(Property& property) {
  property.first_value = ++next_;
  std::uint32_t count = 0;
  for (;; ++next_, ++count) {
    if (Peek().after_gap) FailAtGap("a number, a quoted string or ']'");
    if (At(TokenKind::kCloseBracket)) break;
    if (!IsValue(Peek().kind)) Fail(Peek(), "a number, a quoted string or ']' in a tuple");
  }
  property.value_count = count & 0x3fffffffU;  // never masks: there are fewer tokens
  ++next_;
}

// Moves the collected properties and children of a body to the document.
void Parser::CloseBody(std::uint32_t body, std::size_t first_property, std::size_t first_child) {
  Body& into = document_.bodies[body];
  into.in_macro = in_macro_;
  StoreProperties(into, first_property);
  into.first_child = static_cast<std::uint32_t>(document_.children.size());
  into.child_count = static_cast<std::uint32_t>(open_children_.size() - first_child);
  const auto children = open_children_.begin() + static_cast<std::ptrdiff_t>(first_child);
  ReserveFor(document_.children, into.child_count);
  document_.children.insert(document_.children.end(), children, open_children_.end());
  open_children_.erase(children, open_children_.end());
}

// Stores properties sorted by name. Of properties with equal names, the last wins.
void Parser::StoreProperties(Body& body, std::size_t first) {
  const auto begin = open_properties_.begin() + static_cast<std::ptrdiff_t>(first);
  std::sort(begin, open_properties_.end(), [](const Property& a, const Property& b) {
    return a.name != b.name ? a.name < b.name : a.name_token < b.name_token;
  });
  body.first_property = static_cast<std::uint32_t>(document_.properties.size());
  ReserveFor(document_.properties, open_properties_.size() - first);
  for (auto it = begin; it != open_properties_.end(); ++it) {
    const bool overridden = it + 1 != open_properties_.end() && (it + 1)->name == it->name;
    if (!overridden) document_.properties.push_back(*it);
  }
  body.property_count =
      static_cast<std::uint32_t>(document_.properties.size() - body.first_property);
  open_properties_.erase(begin, open_properties_.end());
}

std::uint32_t Parser::Name(std::uint32_t token) {
  const std::uint32_t name = document_.names.Intern(document_.Text(document_.tokens[token]));
  if (name >= kMaxNames) {
    document_.Fail(document_.tokens[token],
                   "found more than " + std::to_string(kMaxNames) +
                       " different names of entities, properties and macros, expected fewer");
  }
  return name;
}

// ---- mistakes ----

std::string Parser::Describe(const Token& token) const {
  switch (token.kind) {
    case TokenKind::kWord:
      return "the word " + Quoted(document_.Text(token));
    case TokenKind::kNumber:
      return "the number " + Shortened(document_.Text(token));
    case TokenKind::kString:
      return "the string " + Quoted(document_.Text(token));
    case TokenKind::kEnd:
      return "the end of the file";
    default:
      return "'" + std::string(document_.Text(token)) + "'";
  }
}

void Parser::Fail(const Token& token, const std::string& expected) const {
  document_.Fail(token, "syntax error: found " + Describe(token) + ", expected " + expected);
}

// Reports an error at the line end or comment before the next token.
void Parser::FailAtGap(const std::string& expected) const {
  const Token& before = Previous();
  const std::string_view text = document_.sources.Text(before.source);
  const std::size_t after = before.offset + before.length;
  const std::size_t gap = std::min(text.find_first_not_of(" \t", after), text.size());
  const bool comment = gap < text.size() && text[gap] == '#';
  document_.sources.Fail(before.source, gap,
                         std::string("syntax error: found ") +
                             (comment ? "a comment" : "the end of the line") + ", expected " +
                             expected);
}

void Parser::FailUnclosed(const Token& open) const {
  document_.Fail(document_.tokens.back(),
                 "missing ')': found the end of the file, expected ')' for what starts at " +
                     document_.PlaceOf(open).Text());
}

// Explains `size[1 2 3]`, which is read as the word `size[1` and two numbers.
std::string Parser::BlankHint() const {
  if (last_name_ == kNone) return "";
  const std::string_view name = document_.Text(document_.tokens[last_name_]);
  if (name.find('[') == std::string_view::npos || name.back() == ']') return "";
  return " (a space is needed before the '[' in " + Quoted(name) + ")";
}

}  // namespace Stg::worldfile
