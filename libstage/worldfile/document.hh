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

/// What a world file becomes. Nothing is copied out of the text: tokens point into it, properties
/// point to tokens, and all instances of a macro share the macro's properties and children. So an
/// entity costs a dozen bytes, however long its macro is.
namespace Stg::worldfile {

/// Limits that keep a hostile file from taking the machine: one that is refused has taken less than
/// a second and less than 100 MB. None is near what real worlds need: 100 000 robots, written out
/// one by one, are 5 MB of text, 1.4 million tokens and 400 000 entities.
inline constexpr std::size_t kMaxTextBytes = 20U << 20;  // read in all, each inclusion counted
inline constexpr std::size_t kMaxTokens = 2'500'000;     // words, values, brackets
inline constexpr std::size_t kMaxTokenBytes = 262'143;   // of one of them; what Token has room for
inline constexpr std::size_t kMaxNames = 150'000;        // of entities, properties and macros
inline constexpr std::size_t kMaxMacros = 10'000;        // definitions
inline constexpr std::size_t kMaxEntities = 3'000'000;   // in all
inline constexpr std::size_t kMaxMadeEntities =
    25'000;  // besides the following; by macros, that is
inline constexpr std::size_t kMaxEntitiesPerWritten = 50;  // for each that is written somewhere
inline constexpr std::size_t kMaxNesting = 100;            // entities within entities
inline constexpr std::size_t kMaxMacroChain = 30;          // macros based on macros
inline constexpr std::size_t kMaxIncludeDepth = 100;       // files within files
inline constexpr std::size_t kMaxIncludes = 1000;          // include lines, each time they are read
inline constexpr std::size_t kMaxSources = 1023;           // texts; what Token has room for
inline constexpr std::size_t kMaxWarnings = 1000;

inline constexpr std::uint32_t kNone = 0xffffffffU;

enum class TokenKind : std::uint8_t {
  kWord,
  kNumber,
  kString,  // with its quotes
  kOpenParen,
  kCloseParen,
  kOpenBracket,
  kCloseBracket,
  kEnd,  // the one after all others
};

struct Token {
  std::uint32_t offset;
  std::uint32_t length : 18;
  std::uint32_t source : 10;
  TokenKind kind : 3;
  bool after_gap : 1;  // a comment or the end of a line lies before it
};
static_assert(sizeof(Token) == 8 && kMaxTokenBytes < 1U << 18 && kMaxIncludes < 1U << 10);

/// Words as small numbers.
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

  std::deque<std::string> texts_;  // a deque, so that the map's keys stay where they are
  std::unordered_map<std::string_view, std::uint32_t> numbers_;
};

struct Property {
  std::uint32_t name;
  std::uint32_t name_token;
  std::uint32_t first_value;  // token; the values of a tuple follow one another
  std::uint32_t value_count : 30;
  std::uint32_t used : 1;  // fetched for some entity that has it
  /// Number of values, from the first on, that readers have looked at; kNone: any number will do.
  std::uint32_t read_end = 0;
};

/// An entity as written: `NAME ( BODY )`.
struct Child {
  std::uint32_t name;
  std::uint32_t name_token;
  std::uint32_t body;
};

/// What stands between two parentheses. Ranges in Document::properties (sorted by name, each name
/// once) and Document::children (in file order).
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
  std::string error;  // what is wrong with the body: reported when the macro is used
  std::uint32_t chain = kNone;
  std::uint32_t chain_made_at = 0;  // how many macros there were when the chain was made
  bool expanding = false;
};

/// What an entity's type name stands for: macros, the most derived first, down to a plain type.
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

/// A property that is given from outside the file, for all entities that are called so: see
/// settings.hh.
struct OverridingProperty {
  std::uint32_t selector;  // name
  std::uint32_t name;
  std::uint32_t property;
};

/// Text of the world file that a saved copy leaves out.
struct DroppedText {
  std::uint32_t offset;
  std::uint32_t length;
};

struct Document {
  SourceSet sources;
  std::deque<Token> tokens;  // a deque does not copy all tokens each time it grows
  NameTable names;
  std::vector<Property> properties;
  std::vector<Child> children;
  std::vector<Body> bodies;  // the first is the world's
  std::vector<Macro> macros;
  std::vector<Chain> chains;
  std::deque<Entity> entities;                // the first is the world
  std::uint32_t name_of_models = 0;           // the name of the property "name"
  std::size_t written_entities = 0;           // in the text, macros' bodies included
  std::vector<OverridingProperty> overrides;  // of those that fit an entity, the last holds
  std::vector<DroppedText> dropped;
  std::vector<std::string> warnings;
  std::unordered_set<std::string> warnings_seen;

  /// With the world, entity 0, and nothing in it.
  Document();

  /// The token's text; a string's without its quotes.
  std::string_view Text(const Token& token) const;
  Place PlaceOf(const Token& token) const;
  [[noreturn]] void Fail(const Token& token, const std::string& message) const;

  /// Keeps "PLACE: warning: message", once.
  void Warn(const Token& token, const std::string& message);
  void Warn(const std::string& place, const std::string& message);
  /// True if further warnings would not be kept: then their places need not be worked out.
  bool HasAllWarnings() const { return warnings.size() >= kMaxWarnings; }

  /// The property of that name in a body, or kNone.
  std::uint32_t FindIn(std::uint32_t body, std::uint32_t name) const;

  /// The property of that name that holds for an entity (one from outside, its own, or the one of
  /// the most derived macro that has it), or kNone.
  std::uint32_t Find(std::uint32_t entity, std::uint32_t name) const;
  /// The same of what the file says.
  std::uint32_t FindInFile(std::uint32_t entity, std::uint32_t name) const;

  /// The type at the bottom of the entity's macros; "" for the world.
  const std::string& TypeOf(std::uint32_t entity) const {
    return names.Text(chains[entities[entity].chain].type);
  }
  /// Whether that is its type, one of its macros, or its name; "world": of the first entity.
  bool IsCalled(std::uint32_t entity, std::uint32_t selector) const;
};

using messages::Quoted;
using messages::Shortened;

}  // namespace Stg::worldfile

#endif
