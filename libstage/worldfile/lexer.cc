// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/lexer.hh"

#include <fcntl.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <ostream>
#include <system_error>
#include <utility>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "worldfile/characters.hh"
#include "worldfile/find_file.hh"
#include "worldfile/numbers.hh"
#include "worldfile/old_names.hh"

namespace Stg::worldfile {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t'; }
bool IsLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool IsWordPart(char c) {
  return IsLetter(c) || IsDigit(c) || c == '.' || c == '-' || c == '_' || c == '[' || c == ']';
}

bool StartsLikeHex(std::string_view text) {
  return text.size() > 1 && (text[0] == 'x' || text[0] == 'X') &&
         std::isxdigit(static_cast<unsigned char>(text[1])) != 0;
}

// True for characters in numbers of any notation, including refused ones such as 0x1f.
bool IsNotationPart(char c) { return IsLetter(c) || IsNumberPart(c) || c == '_'; }

std::string DescribeByte(char c) {
  const auto byte = static_cast<unsigned char>(c);
  if (byte > 0x20 && byte < 0x7f) return std::string("'") + c + "'";
  char text[16];
  std::snprintf(text, sizeof text, "byte 0x%02x", static_cast<unsigned>(byte));
  return text;
}

// Returns the same key for different paths to a file.
std::string FileKey(const std::string& path) {
  std::error_code error;
  const std::filesystem::path canonical = std::filesystem::canonical(path, error);
  return error ? path : canonical.string();
}

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

}  // namespace

std::string ReadWholeFile(const std::string& path) {
  const auto fail = [&path](const std::string& reason) { throw LoadError(path + ": " + reason); };
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status)) fail("found a directory, expected a file");
  // Some regular files in /proc and /sys would block forever.
  const int no_wait = std::filesystem::is_regular_file(status) ? O_NONBLOCK : 0;
  const int opened = open(path.c_str(), O_RDONLY | O_CLOEXEC | no_wait);
  const std::unique_ptr<std::FILE, CloseFile> file(opened < 0 ? nullptr : fdopen(opened, "rb"));
  if (!file) fail("unable to open the file: " + std::generic_category().message(errno));

  std::string text;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size <= kMaxTextBytes) text.reserve(static_cast<std::size_t>(size));
  char buffer[1 << 16];
  std::size_t count = 0;
  while ((count = std::fread(buffer, 1, sizeof buffer, file.get())) > 0) {
    text.append(buffer, count);
    if (text.size() > kMaxTextBytes) {
      fail("found more than " + std::to_string(kMaxTextBytes >> 20) +
           " MiB of text, expected a world file");
    }
  }
  if (std::ferror(file.get()) != 0) {
    fail("unable to read the file: " + std::generic_category().message(errno));
  }
  return text;
}

Lexer::Lexer(Document& document, std::string base_directory)
    : document_(document), base_directory_(std::move(base_directory)) {}

void Lexer::Run(std::uint16_t source) {
  const std::string_view text = document_.sources.Text(source);
  bytes_ = text.size();
  LexSource(source);
  const Cursor end{source, text, text.size()};
  Push(end, end.at, TokenKind::kEnd);
}

void Lexer::LexSource(std::uint16_t source) {
  CheckEncoding(source);
  Cursor cursor{source, document_.sources.Text(source), document_.sources.Start(source)};
  open_.push_back(source);
  while (cursor.at < cursor.text.size()) LexToken(cursor);
  open_.pop_back();
}

void Lexer::CheckEncoding(std::uint16_t source) const {
  const std::string_view text = document_.sources.Text(source);
  const bool marked = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff");
  const auto nul = [&](std::size_t i) { return text[i] == '\0'; };
  const bool unmarked = text.size() > 3 && nul(0) == nul(2) && nul(1) == nul(3) && nul(0) != nul(1);
  if (!marked && !unmarked) return;
  document_.sources.Fail(source, 0,
                         "found UTF-16 or UTF-32, expected UTF-8; save the file as UTF-8");
}

void Lexer::LexToken(Cursor& cursor) {
  const char c = cursor.text[cursor.at];
  const auto single = [&](TokenKind kind) {
    ++cursor.at;
    Push(cursor, cursor.at - 1, kind);
  };
  if (IsBlank(c)) {
    ++cursor.at;
  } else if (IsLineEnd(c)) {
    cursor.at += LineEndLength(cursor.text, cursor.at);
    gap_ = true;
  } else if (c == '#') {
    while (cursor.at < cursor.text.size() && !IsLineEnd(cursor.text[cursor.at])) ++cursor.at;
    gap_ = true;
  } else if (IsLetter(c)) {
    LexWord(cursor);
  } else if (IsNumberPart(c)) {
    LexNumber(cursor);
  } else if (c == '"') {
    LexString(cursor);
  } else if (c == '(') {
    single(TokenKind::kOpenParen);
  } else if (c == ')') {
    single(TokenKind::kCloseParen);
  } else if (c == '[') {
    single(TokenKind::kOpenBracket);
  } else if (c == ']') {
    single(TokenKind::kCloseBracket);
  } else {
    document_.sources.Fail(cursor.source, cursor.at,
                           "syntax error: found " + DescribeByte(c) +
                               ", expected a word, a number, a quoted string, a parenthesis, a "
                               "bracket or a comment");
  }
}

void Lexer::LexWord(Cursor& cursor) {
  const std::size_t start = cursor.at;
  while (cursor.at < cursor.text.size() && IsWordPart(cursor.text[cursor.at])) ++cursor.at;
  if (cursor.text.substr(start, cursor.at - start) == "include") {
    LexInclude(cursor, start);
  } else {
    Push(cursor, start, TokenKind::kWord);
  }
}

void Lexer::LexNumber(Cursor& cursor) {
  const std::size_t start = cursor.at;
  while (cursor.at < cursor.text.size() && IsNumberPart(cursor.text[cursor.at])) ++cursor.at;
  const std::string_view run = cursor.text.substr(start, cursor.at - start);
  const std::string_view rest = cursor.text.substr(cursor.at);
  const bool has_digit = std::any_of(run.begin(), run.end(), IsDigit);
  // Other letters directly after a number start a new word: `3name "foo"`.
  if (has_digit && StartsLikeExponent(rest)) {
    const std::size_t length = ExponentLength(rest);
    const bool more = length < rest.size() && IsNotationPart(rest[length]);
    if (length == 0 || more) FailNumber(cursor, start);
    cursor.at += length;
  } else if (run.ends_with("0") && StartsLikeHex(rest)) {
    FailNumber(cursor, start);
  }
  Push(cursor, start, TokenKind::kNumber);
}

void Lexer::FailNumber(const Cursor& cursor, std::size_t start) const {
  std::size_t end = cursor.at;
  while (end < cursor.text.size() && IsNotationPart(cursor.text[end])) ++end;
  document_.sources.Fail(cursor.source, start,
                         "syntax error: found " + Quoted(cursor.text.substr(start, end - start)) +
                             ", expected a number such as 16, -0.5 or 9e-06");
}

void Lexer::LexString(Cursor& cursor) {
  const std::size_t start = cursor.at++;
  while (cursor.at < cursor.text.size() && cursor.text[cursor.at] != '"') {
    const char c = cursor.text[cursor.at];
    if (IsLineEnd(c)) break;
    if (c == '\0') {
      document_.sources.Fail(cursor.source, cursor.at,
                             "syntax error: found byte 0x00 in a string, expected text");
    }
    ++cursor.at;
  }
  const bool at_end = cursor.at == cursor.text.size();
  if (at_end || cursor.text[cursor.at] != '"') {
    document_.sources.Fail(cursor.source, start,
                           std::string("unterminated string constant: found the end of the ") +
                               (at_end ? "file" : "line") + ", expected '\"'");
  }
  ++cursor.at;
  Push(cursor, start, TokenKind::kString);
}

void Lexer::LexInclude(Cursor& cursor, std::size_t word) {
  const std::string name = IncludeName(cursor, word);
  const std::size_t quote = cursor.at - name.size() - 2;
  SkipRestOfLine(cursor);
  messages::Progress("[Include " + Shortened(name, messages::kMaxDetailBytes) + "]");
  if (++includes_ > kMaxIncludes) {
    document_.sources.Fail(
        cursor.source, word,
        "found more than " + std::to_string(kMaxIncludes) + " include lines, expected fewer");
  }
  gap_ = true;
  LexSource(OpenInclude(cursor, quote, name));
  gap_ = true;
}

std::string Lexer::IncludeName(Cursor& cursor, std::size_t word) const {
  const auto fail = [&](std::size_t at, const std::string& found) {
    const bool at_end = at >= cursor.text.size();
    document_.sources.Fail(cursor.source, at_end ? word : at,
                           (at_end ? "incomplete include statement: found "
                                   : "syntax error in include statement: found ") +
                               found + ", expected include \"FILE\" on one line");
  };
  const auto describe = [&](std::size_t at) -> std::string {
    if (at >= cursor.text.size()) return "the end of the file";
    if (IsLineEnd(cursor.text[at])) return "the end of the line";
    return DescribeByte(cursor.text[at]);
  };

  std::size_t at = cursor.at;
  while (at < cursor.text.size() && IsBlank(cursor.text[at])) ++at;
  if (at == cursor.at || at >= cursor.text.size() || cursor.text[at] != '"') {
    fail(at, describe(at));
  }
  const std::size_t start = at + 1;
  const std::size_t end = cursor.text.find_first_of(std::string_view("\"\r\n\0", 4), start);
  if (end == std::string_view::npos) fail(cursor.text.size(), describe(cursor.text.size()));
  if (cursor.text[end] != '"') fail(end, describe(end));
  cursor.at = end + 1;
  return std::string(cursor.text.substr(start, end - start));
}

// The rest of an include line is neither read, as in Stage 4.3, nor saved. Warns unless it is a
// comment.
void Lexer::SkipRestOfLine(Cursor& cursor) {
  const std::size_t start = cursor.at;
  while (cursor.at < cursor.text.size() && !IsLineEnd(cursor.text[cursor.at])) ++cursor.at;
  const std::string_view rest = cursor.text.substr(start, cursor.at - start);
  const std::size_t text = rest.find_first_not_of(" \t");
  if (text != std::string_view::npos && rest[text] != '#' && !document_.HasAllWarnings()) {
    document_.Warn(document_.sources.PlaceOf(cursor.source, start + text).Text(),
                   "what follows an include on its line is not read: " + Quoted(rest.substr(text)));
  }
  if (cursor.source == 0 && !rest.empty()) {
    document_.dropped.push_back(
        {static_cast<std::uint32_t>(start), static_cast<std::uint32_t>(rest.size())});
  }
}

std::uint16_t Lexer::OpenInclude(const Cursor& cursor, std::size_t quote, const std::string& name) {
  const auto fail = [&](const std::string& message) {
    document_.sources.Fail(cursor.source, quote, message);
  };
  std::string reason;
  const std::string path = FindFile(base_directory_, name, &reason);
  if (path.empty()) {
    const std::string hint = SuccessorOfInclude(name);
    fail("unable to open include file " +
         Shortened(CompletePath(base_directory_, name), messages::kMaxDetailBytes) + " : " +
         reason +
         (hint.empty() ? AdviceForMissing(base_directory_, name, ".inc")
                       : "; among the files installed with Stage, " + hint));
  }
  const std::string key = FileKey(path);
  CheckCycle(cursor, quote, key);
  if (open_.size() > kMaxIncludeDepth) {
    fail("found includes nested more than " + std::to_string(kMaxIncludeDepth) +
         " deep, expected fewer");
  }
  int source = document_.sources.Find(key);
  if (source < 0) {
    std::error_code unknown;
    if (!std::filesystem::is_regular_file(path, unknown)) {
      fail("found a special file, expected a plain file to include: " +
           Shortened(path, messages::kMaxDetailBytes));
    }
    try {
      source = static_cast<int>(document_.sources.Add(path, key, ReadWholeFile(path)));
    } catch (const LoadError& error) {
      fail(std::string("unable to include ") + error.what());
    }
  }
  bytes_ += document_.sources.Text(static_cast<std::uint32_t>(source)).size();
  if (bytes_ > kMaxTextBytes) {
    fail("found more than " + std::to_string(kMaxTextBytes >> 20) +
         " MiB of included text, expected less");
  }
  return static_cast<std::uint16_t>(source);
}

void Lexer::CheckCycle(const Cursor& cursor, std::size_t quote, const std::string& key) const {
  const int source = document_.sources.Find(key);
  std::string cycle;
  for (const std::uint16_t open : open_) {
    if (open == source || !cycle.empty()) cycle += document_.sources.Name(open) + " -> ";
  }
  if (cycle.empty()) return;
  document_.sources.Fail(cursor.source, quote,
                         "found an include cycle (" + cycle +
                             document_.sources.Name(static_cast<std::uint32_t>(source)) +
                             "), expected a file that does not include itself");
}

void Lexer::Push(const Cursor& cursor, std::size_t start, TokenKind kind) {
  if (document_.tokens.size() >= kMaxTokens) {
    document_.sources.Fail(
        cursor.source, start,
        "found more than " + std::to_string(kMaxTokens) + " words and values, expected fewer");
  }
  const std::size_t length = cursor.at - start;
  if (length > kMaxTokenBytes) {
    document_.sources.Fail(cursor.source, start,
                           "found a word, number or string of " + std::to_string(length) +
                               " bytes, expected at most " + std::to_string(kMaxTokenBytes));
  }
  Token token{static_cast<std::uint32_t>(start), 0, 0, kind, gap_};
  token.length = length & 0x3ffffU;
  token.source = cursor.source & 0x3ffU;
  document_.tokens.push_back(token);
  gap_ = false;
}

}  // namespace Stg::worldfile
