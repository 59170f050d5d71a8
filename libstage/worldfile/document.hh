// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_DOCUMENT_HH
#define STAGE_WORLDFILE_DOCUMENT_HH

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "messages/report.hh"
#include "worldfile/source.hh"

/// The parsed form of a world file. Nothing is copied from the text: tokens point into it,
/// properties point to tokens, and all instances of a macro share its properties and children. An
/// entity takes a dozen bytes, however long its macro is.
namespace Stg::worldfile {

/// Limits that bound the cost of hostile files: refusing one takes less than a second and less than
/// 100 MB. Real worlds stay far below: 100 000 robots, written out one by one, are 5 MB of text,
/// 1.4 million tokens and 400 000 entities.
inline constexpr std::size_t kMaxTextBytes = 20U << 20;    // in total, each inclusion counted
inline constexpr std::size_t kMaxTokens = 2'500'000;       // words, values, brackets
inline constexpr std::size_t kMaxTokenBytes = 262'143;     // per token; limited by Token::length
inline constexpr std::size_t kMaxNames = 150'000;          // of entities, properties and macros
inline constexpr std::size_t kMaxMacros = 10'000;          // definitions
inline constexpr std::size_t kMaxEntities = 3'000'000;     // in total
inline constexpr std::size_t kMaxMadeEntities = 25'000;    // entities, plus the following
inline constexpr std::size_t kMaxEntitiesPerWritten = 50;  // per entity written in the text
inline constexpr std::size_t kMaxNesting = 100;            // depth of entities within entities
inline constexpr std::size_t kMaxMacroChain = 30;          // length of a chain of macros
inline constexpr std::size_t kMaxIncludeDepth = 100;       // depth of nested includes
inline constexpr std::size_t kMaxIncludes = 1000;  // include lines, counted each time they are read
inline constexpr std::size_t kMaxSources = 1023;   // texts; limited by Token::source
inline constexpr std::size_t kMaxWarnings = 1000;

inline constexpr std::uint32_t kNone = 0xffffffffU;

enum class TokenKind : std::uint8_t {
  kWord,
  kNumber,
  kString,  // including its quotes
  kOpenParen,
  kCloseParen,
  kOpenBracket,
  kCloseBracket,
  kEnd,  // follows the last token
};

struct Token {
  std::uint32_t offset;
  std::uint32_t length : 18;
  std::uint32_t source : 10;
  TokenKind kind : 3;
  bool after_gap : 1;  // preceded by a comment or a line end
};
static_assert(sizeof(Token) == 8 && kMaxTokenBytes < 1U << 18);
static_assert(kMaxIncludes < kMaxSources && kMaxSources < 1U << 10);

/// Interns words as small numbers.
class NameTable {
 public:
  NameTable() = default;
  NameTable(const NameTable& from) : texts_(from.texts_) { NumberAll(); }
  NameTable& operator=(const NameTable& from) {
    texts_ = from.texts_;
    NumberAll();
    return *this;
  }

  std::uint32_t Intern(std::string_view text);
  const std::string& Text(std::uint32_t name) const { return texts_[name]; }
  std::uint32_t Count() const { return static_cast<std::uint32_t>(texts_.size()); }

 private:
  void NumberAll();

  std::deque<std::string> texts_;  // a deque keeps the map's keys valid
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
};

struct Property {
  std::uint32_t name;
  std::uint32_t name_token;
  std::uint32_t first_value;  // token index; the values of a tuple are adjacent
  std::uint32_t value_count : 30;
  std::uint32_t used : 1;  // fetched for some entity that has it
  /// Number of leading values that readers have accessed; kNone: readers accept any number.
  std::uint32_t read_end = 0;
};

/// An entity as written: `NAME ( BODY )`.
struct Child {
  std::uint32_t name;
  std::uint32_t name_token;
  std::uint32_t body;
};

/// The content of a pair of parentheses: ranges in Document::properties (sorted by name, without
/// duplicates) and Document::children (in file order).
struct Body {
  std::uint32_t first_property = 0;
  std::uint32_t property_count = 0;
  std::uint32_t first_child = 0;
  std::uint32_t child_count = 0;
  std::uint32_t close_token = kNone;
  bool in_macro = false;  // shared by all instances of a macro
};

struct Macro {
  std::uint32_t name;
  std::uint32_t base;  // name
  std::uint32_t name_token;
  std::uint32_t body;
  std::string error;  // error in the body, reported when the macro is used
  std::uint32_t chain = kNone;
  std::uint32_t chain_made_at = 0;  // number of macros when the chain was made
  bool expanding = false;
};

/// The expansion of an entity's type name: macros, most derived first, and the plain type.
struct Chain {
  std::vector<std::uint32_t> macros;
  std::uint32_t type = 0;  // name
};

struct Entity {
  std::uint32_t body;
  std::uint32_t chain;
  std::uint32_t name_token;  // kNone for the world
  std::int32_t parent;
};

/// A property set from outside the file for all entities that match a selector: see settings.hh.
struct OverridingProperty {
  std::uint32_t selector;  // name
  std::uint32_t name;
  std::uint32_t property;
  std::uint32_t entity;  // if the selector is its number; otherwise kNone
};

/// A range of text in the world file that Save() omits.
struct DroppedText {
  std::uint32_t offset;
  std::uint32_t length;
};

struct Document {
  SourceSet sources;
  std::deque<Token> tokens;  // a deque does not copy all tokens when it grows
  NameTable names;
  std::vector<Property> properties;
  std::vector<Child> children;
  std::vector<Body> bodies;  // the first one is the world's
  std::vector<Macro> macros;
  std::vector<Chain> chains;
  std::deque<Entity> entities;                // the first one is the world
  std::uint32_t name_of_models = 0;           // number of the name "name"
  std::size_t written_entities = 0;           // in the text, including bodies of macros
  std::vector<OverridingProperty> overrides;  // of those that match an entity, the last one applies
  std::vector<DroppedText> dropped;
  std::vector<std::string> warnings;
  std::unordered_set<std::string> warnings_seen;

  /// Creates a document with only the world, entity 0.
  Document();

  /// Text of the token; strings without their quotes.
  std::string_view Text(const Token& token) const;
  Place PlaceOf(const Token& token) const;
  [[noreturn]] void Fail(const Token& token, const std::string& message) const;

  /// Stores "PLACE: warning: message", unless it is stored already.
  void Warn(const Token& token, const std::string& message);
  void Warn(const std::string& place, const std::string& message);
  /// True if the limit of warnings is reached: then callers need not compute places.
  bool HasAllWarnings() const { return warnings.size() >= kMaxWarnings; }

  /// Property with this name in a body, or kNone.
  std::uint32_t FindIn(std::uint32_t body, std::uint32_t name) const;

  /// Property with this name that applies to an entity, or kNone: an override, or else the entity's
  /// own, or else that of its most derived macro that has it.
  std::uint32_t Find(std::uint32_t entity, std::uint32_t name) const;
  /// Like Find(), but ignores overrides.
  std::uint32_t FindInFile(std::uint32_t entity, std::uint32_t name) const;

  /// The plain type of the entity; "" for the world.
  const std::string& TypeOf(std::uint32_t entity) const {
    return names.Text(chains[entities[entity].chain].type);
  }
  /// True if `selector` is its type, one of its macros or its name, or "world" for entity 0.
  bool IsCalled(std::uint32_t entity, std::uint32_t selector) const;
  /// True if the override applies to the entity.
  bool Selects(const OverridingProperty& override, std::uint32_t entity) const {
    return override.entity == kNone ? IsCalled(entity, override.selector)
                                    : override.entity == entity;
  }
};

using messages::Quoted;
using messages::Shortened;

}  // namespace Stg::worldfile

#endif
