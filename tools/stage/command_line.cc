// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/command_line.hh"

#include <algorithm>
#include <string_view>

#include "stage/option_values.hh"

namespace Stg::program {

namespace {

constexpr int kFirstLongOption = 256;  // for options without a short form, above all characters

std::string NameOf(int id, const std::vector<option>& table) {
  const auto found = std::ranges::find(table, id, &option::val);
  return found->name ? std::string("--") + found->name : std::string("-") + static_cast<char>(id);
}

/// Describes why getopt rejected a long option: it is unknown, or an ambiguous prefix.
std::string UnknownLongOption(const std::vector<option>& table, const std::string& given) {
  const std::string prefix = given.substr(2, given.find('=') - 2);
  std::string candidates;
  for (const option& o : table)
    if (o.name && std::string_view(o.name).starts_with(prefix))
      candidates += (candidates.empty() ? "--" : ", --") + std::string(o.name);
  if (candidates.empty()) return "there is no option '" + given + "'";
  return "'" + given + "' may mean any of " + candidates;
}

/// Reports an option that getopt_long() has rejected with `id`; `word` is what it looked at last.
[[noreturn]] void Refuse(int id, const std::vector<option>& table, const std::string& word) {
  if (id == ':') throw UsageError(NameOf(optopt, table) + " needs a value");
  if (optopt >= kFirstLongOption) throw UsageError(NameOf(optopt, table) + " takes no value");
  if (optopt != 0)
    throw UsageError(std::string("there is no option '-") + static_cast<char>(optopt) + "'");
  throw UsageError(UnknownLongOption(table, word));
}

}  // namespace

CommandOption::Action Store(std::string* to) {
  return [to](const std::string&, const std::string& value) { *to = value; };
}

CommandOption::Action StoreNonEmpty(std::string* to, const char* expected) {
  return [to, expected](const std::string& name, const std::string& value) {
    if (value.empty()) RefuseValue(name, expected, value);
    *to = value;
  };
}

std::vector<CommandOption> RunCommandOptions(RunOptions* options) {
  std::vector<CommandOption> commands;
  for (const RunOption& o : RunOptionTable()) {
    const int argument = o.type == RunOption::Type::kSwitch   ? no_argument
                         : o.type == RunOption::Type::kDevice ? optional_argument
                                                              : required_argument;
    commands.push_back(
        {o.flag, argument, [&o, options](const std::string& name, const std::string& value) {
           if (!o.Parse(value, options)) RefuseValue(name, o.Expected(), value);
         }});
  }
  return commands;
}

std::vector<CommandOption> LogCommandOptions(const std::function<recording::LogOptions*()>& log) {
  using Text = const std::string&;
  return {
      {"log-compression", required_argument,
       [log](Text name, Text value) { log()->compression = ParseCompression(name, value); }},
      {"log-every", required_argument,
       [log](Text name, Text value) { log()->every = ParseDuration(name, value); }},
      {"log-models", required_argument,
       [log](Text name, Text value) { log()->robots = ParseNames(name, value); }},
      {"log-ranges", required_argument,
       [log](Text name, Text value) { log()->ranges = ParseRanges(name, value); }},
  };
}

CommandLine ParseCommandLine(std::vector<char*> arguments, std::vector<CommandOption> options,
                             const std::function<bool()>& done) {
  std::ranges::sort(options, {}, [](const CommandOption& o) { return std::string_view(o.name); });
  std::string letters = ":";  // the colon makes getopt silent and tells missing values apart
  std::vector<option> table;
  for (const CommandOption& o : options) {
    const int id = o.letter ? o.letter : kFirstLongOption + static_cast<int>(table.size());
    table.push_back({o.name, o.argument, nullptr, id});
    if (o.letter) letters += o.letter;
    if (o.letter && o.argument == required_argument) letters += ':';
  }
  table.push_back({nullptr, 0, nullptr, 0});
  const int count = static_cast<int>(arguments.size());
  arguments.push_back(nullptr);
  CommandLine line;
  while (!done()) {
    int id = getopt_long(count, arguments.data(), letters.c_str(), table.data(), nullptr);
    if (id == -1) break;
    if (id == '?' && optopt == '?') id = 'h';  // getopt returns '?' for any mistake
    if (id == '?' || id == ':') Refuse(id, table, arguments[static_cast<size_t>(optind - 1)]);
    const auto at = std::ranges::find(table, id, &option::val) - table.begin();
    line.given.push_back(NameOf(id, table));
    options[static_cast<size_t>(at)].action(line.given.back(), optarg ? optarg : "");
  }
  line.operands.assign(arguments.begin() + optind, arguments.end() - 1);
  return line;
}

}  // namespace Stg::program
