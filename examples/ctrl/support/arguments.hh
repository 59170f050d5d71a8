// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parses a controller's arguments: the words after its name in the `ctrl` string.

#ifndef EXAMPLES_CTRL_SUPPORT_ARGUMENTS_HH
#define EXAMPLES_CTRL_SUPPORT_ARGUMENTS_HH

#include <locale>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace ctrl {

/// Splits text at blanks and tabs.
inline std::vector<std::string> SplitWords(std::string_view text) {
  std::vector<std::string> words;
  for (size_t begin = text.find_first_not_of(" \t"); begin != std::string_view::npos;) {
    const size_t end = text.find_first_of(" \t", begin);
    words.emplace_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(" \t", end);
  }
  return words;
}

/// A numeric argument, given as NAME=VALUE.
struct NumberArgument {
  std::string_view name;
  double* value;  ///< holds the default; receives the given value
  double min, max;
};

/// Parses the whole text as a number within the argument's bounds. Returns false on failure.
inline bool ReadNumber(std::string_view text, const NumberArgument& argument) {
  double value = 0;
  // Rejects blanks, names and hexadecimals. strtod depends on the process's locale, and libc++
  // supports std::from_chars for doubles only from version 20 on.
  if (text.find_first_not_of("0123456789.eE+-") != std::string_view::npos) return false;
  if (!text.empty() && text.front() == '+') return false;
  std::istringstream stream{std::string(text)};
  stream.imbue(std::locale::classic());
  if (!(stream >> value) || !stream.eof()) return false;
  if (!(value >= argument.min && value <= argument.max)) return false;
  *argument.value = value;
  return true;
}

/// Returns "speed=NUMBER, gain=NUMBER".
inline std::string Usage(const std::vector<NumberArgument>& arguments) {
  std::string usage;
  for (const NumberArgument& a : arguments)
    usage += (usage.empty() ? "" : ", ") + std::string(a.name) + "=NUMBER";
  return usage;
}

/// Parses the words of a `ctrl` string after the first. Returns an empty text, or a description of
/// the mistake.
inline std::string ReadArguments(std::string_view ctrl_string,
                                 const std::vector<NumberArgument>& arguments) {
  const std::vector<std::string> words = SplitWords(ctrl_string);
  for (size_t i = 1; i < words.size(); i++) {
    const std::string_view word = words[i];
    const size_t equals = word.find('=');
    const NumberArgument* match = nullptr;
    if (equals != std::string_view::npos)
      for (const NumberArgument& a : arguments)
        if (a.name == word.substr(0, equals)) match = &a;
    if (!match) return "found the argument \"" + words[i] + "\", expected " + Usage(arguments);
    if (!ReadNumber(word.substr(equals + 1), *match))
      return "found \"" + words[i] + "\", expected a number from " + std::to_string(match->min) +
             " to " + std::to_string(match->max);
  }
  return "";
}

}  // namespace ctrl

#endif
