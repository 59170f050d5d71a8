// SPDX-License-Identifier: GPL-2.0-or-later
//
// Command lines: a command lists its options with what they do. All functions throw UsageError.

#ifndef STAGE_TOOLS_STAGE_COMMAND_LINE_HH
#define STAGE_TOOLS_STAGE_COMMAND_LINE_HH

#include <getopt.h>

#include <functional>
#include <string>
#include <vector>

#include "recording/recorder.hh"
#include "world/run_option.hh"

namespace Stg::program {

/// An option of a command.
struct CommandOption {
  /// Gets the option's name, such as "--log", and its value, which is empty if there is none.
  using Action = std::function<void(const std::string& name, const std::string& value)>;

  const char* name;  ///< without the hyphens
  int argument;      ///< no_argument, required_argument or optional_argument
  Action action;
  char letter = 0;  ///< of the short form
};

struct CommandLine {
  std::vector<std::string> given;     ///< names of options, such as "--log", in their order
  std::vector<std::string> operands;  ///< all other words
};

/// An action that sets `to` to `value`.
template <typename T, typename Value>
CommandOption::Action Set(T* to, Value value) {
  return [to, value](const std::string&, const std::string&) { *to = value; };
}
/// An action that sets `to` to the option's value.
CommandOption::Action Store(std::string* to);
/// Like Store(), but refuses an empty value; `expected` describes it.
CommandOption::Action StoreNonEmpty(std::string* to, const char* expected);

/// Options of all commands that run worlds: those of RunOptionTable(). They set `options`.
std::vector<CommandOption> RunCommandOptions(RunOptions* options);

/// Options of logs but --log itself. They set what `log` returns.
std::vector<CommandOption> LogCommandOptions(const std::function<recording::LogOptions*()>& log);

/// Calls the actions of options in their order, until done(). Call it only once, because getopt has
/// global state. The options must include "help", which -? stands for as well.
CommandLine ParseCommandLine(std::vector<char*> arguments, std::vector<CommandOption> options,
                             const std::function<bool()>& done);

}  // namespace Stg::program

#endif
