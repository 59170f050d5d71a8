// SPDX-License-Identifier: GPL-2.0-or-later
//
// stage merge: writes the records of a sweep as one table. Equal records give equal bytes.

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "files/whole_file.hh"
#include "messages/report.hh"
#include "stage/command_line.hh"
#include "stage/option_values.hh"
#include "stage/process.hh"
#include "stage/python_module.hh"
#include "stage/sweep/commands.hh"
#include "stage/sweep/folder.hh"
#include "stage/sweep/help.hh"

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;

struct MergeOptions {
  std::vector<std::string> folders;  // folders of one sweep, each with a part of its runs
  std::string file;
  bool partial = false, timings = false, help = false;
};

MergeOptions ParseMergeOptions(int argc, char* argv[]) {
  std::vector<char*> arguments(argv, argv + argc);
  arguments.erase(arguments.begin() + 1);
  MergeOptions options;
  const std::vector<CommandOption> known = {
      {"help", no_argument, Set(&options.help, true), 'h'},
      {"out", required_argument, Store(&options.file), 'o'},
      {"partial", no_argument, Set(&options.partial, true)},
      {"timings", no_argument, Set(&options.timings, true)},
  };
  options.folders = ParseCommandLine(arguments, known, [&] { return options.help; }).operands;
  if (options.help) return options;
  if (options.folders.empty()) throw UsageError("merge: expected a folder, that of a sweep");
  for (const char* ending : {".csv", ".parquet", ".h5"})
    if (options.file.size() > std::strlen(ending) && options.file.ends_with(ending)) return options;
  RefuseValue("--out", "a name that ends in .csv, .parquet or .h5", options.file);
}

/// The table: one row per run, in order.
class Table {
 public:
  Table(const MergeOptions& options, const Plan& plan) : options_(options) {
    for (const char* name : kNames) ColumnOf(name);
    for (const Axis& axis : plan.axes) ColumnOf(axis.name);
    for (const char* name : kResults) ColumnOf(name);
  }

  void Add(const Json& record) {
    Row row;
    for (const char* name : kNames) Put(&row, name, record.at(name));
    PutAll(&row, "", record.at("set"));
    for (const char* name : kResults) Put(&row, name, record.value(name, Json()));
    PutAll(&row, "energy_", record.value("energy", Json::object()));
    if (fixed_ == 0 && record.at("status") == "done") fixed_ = names_.size();
    PutMetrics(&row, record.value("metrics", Json::object()));
    if (options_.timings) PutAll(&row, "timing_", record.value("timing", Json::object()));
    rows_.push_back(std::move(row));
  }

  std::string ToCsv() const {
    std::string text;
    for (const std::string& name : names_) text += (&name == names_.data() ? "" : ",") + Cell(name);
    text += '\n';
    for (const Row& row : rows_) {
      for (size_t i = 0; i < names_.size(); i++) {
        if (i > 0) text += ',';
        if (i < row.size()) text += row[i];
      }
      text += '\n';
    }
    return text;
  }

 private:
  // Columns of every record, before and after the values of the axes.
  static constexpr const char* kNames[] = {"index", "run", "seed"};
  static constexpr const char* kResults[] = {"status", "state_hash", "steps", "simulated_seconds",
                                             "rays"};
  using Row = std::vector<std::string>;  // indexed by column; missing trailing cells are empty

  static std::string Cell(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + "\"";
  }

  size_t ColumnOf(const std::string& name) {
    const auto [column, is_new] = columns_.try_emplace(name, names_.size());
    if (is_new) names_.push_back(name);
    return column->second;
  }

  void Put(Row* row, const std::string& name, const Json& value) {
    const size_t column = ColumnOf(name);
    if (row->size() <= column) row->resize(column + 1);
    if (value.is_null()) return;
    (*row)[column] = Cell(value.is_string() ? value.get<std::string>() : value.dump());
  }

  void PutAll(Row* row, const std::string& prefix, const Json& values) {
    for (const auto& [name, value] : values.items()) Put(row, prefix + name, value);
  }

  /// A metric with the name of another column becomes metric_NAME.
  void PutMetrics(Row* row, const Json& metrics) {
    for (const auto& [name, value] : metrics.items()) {
      const auto column = columns_.find(name);
      const bool taken = column != columns_.end() && column->second < fixed_;
      Put(row, taken ? "metric_" + name : name, value);
    }
  }

  const MergeOptions& options_;
  size_t fixed_ = 0;                // number of columns before the metrics
  std::vector<std::string> names_;  // in the order of first appearance
  std::map<std::string, size_t> columns_;
  std::vector<Row> rows_;
};

constexpr size_t kNotFound = SIZE_MAX;

/// Returns, by run index, which folder has the record; kNotFound if unfinished.
std::vector<size_t> FindRecords(const std::vector<SweepFolder>& folders, const Plan& plan) {
  std::vector<size_t> places(static_cast<size_t>(plan.Count()), kNotFound);
  for (size_t i = folders.size(); i-- > 0;) {
    const std::vector<bool> finished = folders[i].Finished(plan);
    for (size_t index = 0; index < places.size(); index++)
      if (finished[index]) places[index] = i;
  }
  return places;
}

void CheckWhole(const SweepFolder& folder, const std::vector<size_t>& places, bool partial) {
  const auto missing = std::ranges::count(places, kNotFound);
  if (missing == 0) return;
  const std::string text = folder.path() + ": " + std::to_string(missing) + " of " +
                           std::to_string(places.size()) + " runs are not finished";
  if (!partial)
    throw std::runtime_error(text + "; stage sweep --resume " + folder.path() +
                             " runs them; --partial merges the finished runs");
  messages::Warn(text);
}

/// Reads the first folder's plan and checks that all others are equal.
Plan PlanOf(const std::vector<SweepFolder>& folders) {
  Plan plan = folders[0].Read();
  const std::string text = ToJson(plan);
  for (size_t i = 1; i < folders.size(); i++)
    if (ToJson(folders[i].Read()) != text)
      throw std::runtime_error("found different sweeps in '" + folders[0].path() + "' and '" +
                               folders[i].path() + "', expected parts of one");
  return plan;
}

std::string TableOf(const MergeOptions& options) {
  const std::vector<SweepFolder> folders(options.folders.begin(), options.folders.end());
  const Plan plan = PlanOf(folders);
  const std::vector<size_t> places = FindRecords(folders, plan);
  CheckWhole(folders[0], places, options.partial);
  Table table(options, plan);
  for (size_t index = 0; index < places.size(); index++) {
    if (places[index] == kNotFound) continue;
    table.Add(folders[places[index]].Record(plan, index));
  }
  return table.ToCsv();
}

}  // namespace

int Merge(int argc, char* argv[]) {
  const MergeOptions options = ParseMergeOptions(argc, argv);
  if (options.help) {
    PrintWhole(kMergeHelpText);
    return 0;
  }
  if (!options.file.ends_with(".csv")) {
    std::vector<std::string> arguments = {"merge", "-o", options.file};
    if (options.partial) arguments.emplace_back("--partial");
    if (options.timings) arguments.emplace_back("--timings");
    arguments.insert(arguments.end(), options.folders.begin(), options.folders.end());
    BecomePythonModule("stagesim.sweep", arguments);
  }
  const std::string table = TableOf(options);
  const auto is_table = [](std::string_view beginning) {
    return beginning.starts_with("index,run,seed,");
  };
  if (const int error = files::ReplaceFile(options.file, table, is_table); error != 0)
    throw std::runtime_error(
        "can't write '" + options.file +
        "': " + (error == EEXIST ? "it exists and is not a merged table" : std::strerror(error)));
  return 0;
}

}  // namespace Stg::program
