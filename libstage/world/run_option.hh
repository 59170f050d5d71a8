// SPDX-License-Identifier: GPL-2.0-or-later
//
// The table of the options of runs that users set. Command lines, their help, JSON, the Python
// package, the ROS node and sweeps iterate over it, so that a new option is one row here and a
// member of RunOptions.

#ifndef STAGE_WORLD_RUN_OPTION_HH
#define STAGE_WORLD_RUN_OPTION_HH

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "world/world.hh"

namespace Stg {

/// The value of an option. The first type stands for none, with which the world file or the machine
/// decides.
using OptionValue =
    std::variant<std::monostate, bool, uint64_t, double, std::string, std::vector<std::string>>;

/// An option of RunOptions.
struct RunOption {
  enum class Type {
    kSwitch,   ///< bool; on command lines the flag alone stands for the value that is not the
               ///< default
    kNumber,   ///< uint64_t from `min` to `max`
    kSeconds,  ///< double, of simulated time
    kChoice,   ///< string, one of `choices`
    kDevice,   ///< string, which is optional on command lines; none: no device
    kTexts     ///< strings; on command lines one each time
  };

  const char* name;  ///< in JSON and Python, such as "ray_model"
  const char* flag;  ///< on command lines, such as "ray-model"
  Type type;
  const char* placeholder;  ///< stands for the value in help
  bool changes_results;
  const char* help;  ///< lines after the first that start with a blank are not wrapped
  OptionValue (*get)(const RunOptions&);
  void (*set)(RunOptions*, const OptionValue&);  ///< the value must be of the option's type
  uint64_t min = 0, max = 0;
  std::vector<std::string> choices = {};
  bool of_world = true;  ///< false: of runs by the program; the Python package ends runs by itself

  OptionValue Default() const { return get(RunOptions()); }
  /// The help up to its first full stop.
  std::string Summary() const;
  /// Describes the valid values, such as "a whole number, from 1 to 1024".
  std::string Expected() const;
  /// The option as it stands in help, such as "--ray-model cell|exact".
  std::string Usage() const;
  /// Sets the option as on a command line; `text` is empty if there is no value. Returns false for
  /// an invalid value.
  bool Parse(const std::string& text, RunOptions* options) const;
  /// Pairs (flag, value) of a command line that sets the option as it is in `options`; none for the
  /// default. The value is empty if the flag has none.
  std::vector<std::pair<std::string, std::string>> Arguments(const RunOptions& options) const;
};

/// All options, in the order of the help.
const std::vector<RunOption>& RunOptionTable();
/// The option of that name, which must exist.
const RunOption& FindRunOption(std::string_view name);

}  // namespace Stg

#endif
