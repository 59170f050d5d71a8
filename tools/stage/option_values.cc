// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/option_values.hh"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "stage/parse_number.hh"

namespace Stg::program {

namespace {

constexpr int kMaxThreads = 1024;

/// Describes why getopt rejected a long option: it is unknown, or an ambiguous prefix.
std::string UnknownLongOption(const option* table, const std::string& given) {
  const std::string prefix = given.substr(2, given.find('=') - 2);
  std::string candidates;
  for (const option* o = table; o->name; o++)
    if (std::string_view(o->name).starts_with(prefix))
      candidates += (candidates.empty() ? "--" : ", --") + std::string(o->name);
  if (candidates.empty()) return "there is no option '" + given + "'";
  return "'" + given + "' may mean any of " + candidates;
}

std::string NameOf(int id, const option* table) {
  for (const option* o = table; o->name; o++)
    if (o->val == id) return std::string("--") + o->name;
  return std::string("-") + static_cast<char>(id);
}

}  // namespace

void RefuseValue(const std::string& option, const std::string& expected, const std::string& found) {
  throw UsageError(option + ": found '" + found + "', expected " + expected);
}

void RefuseOption(int id, const option* table, const std::string& word) {
  if (id == ':') throw UsageError(NameOf(optopt, table) + " needs a value");
  if (optopt >= kFirstLongOption) throw UsageError(NameOf(optopt, table) + " takes no value");
  if (optopt != 0)
    throw UsageError(std::string("there is no option '-") + static_cast<char>(optopt) + "'");
  throw UsageError(UnknownLongOption(table, word));
}

double ParseWithin(const std::string& option, double min, double max, const char* expected,
                   const std::string& text) {
  const std::optional<double> value = ParseNumber<double>(text);
  // The comparisons are false for NaN.
  if (!value || !(*value >= min && *value <= max)) RefuseValue(option, expected, text);
  return *value;
}

usec_t ParseDuration(const std::string& option, const std::string& text) {
  const double seconds =
      ParseWithin(option, 1e-6, kMaxDuration, "simulated seconds, from 0.000001 to 1e12", text);
  return static_cast<usec_t>(std::llround(seconds * 1e6));
}

std::vector<std::string> ParseNames(const std::string& option, const std::string& text) {
  std::vector<std::string> names;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    if (end == begin) RefuseValue(option, "names with a comma between them", text);
    names.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return names;
}

uint64_t ParseSeed(const std::string& option, const std::string& text) {
  const std::optional<uint64_t> seed = ParseNumber<uint64_t>(text);
  if (!seed) RefuseValue(option, "a whole number, from 0 to 18446744073709551615", text);
  return *seed;
}

int ParseThreads(const std::string& option, const std::string& text) {
  const std::optional<int> threads = ParseNumber<int>(text);
  if (!threads || *threads < 1 || *threads > kMaxThreads)
    RefuseValue(option, "a whole number, from 1 to " + std::to_string(kMaxThreads), text);
  return *threads;
}

RayModel ParseRayModel(const std::string& option, const std::string& text) {
  if (text != "cell" && text != "exact") RefuseValue(option, "cell or exact", text);
  return text == "cell" ? RayModel::kCell : RayModel::kExact;
}

recording::Compression ParseCompression(const std::string& option, const std::string& text) {
  using recording::Compression;
  for (const Compression compression :
       {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    const bool none = compression == Compression::kNone;
    if (text != (none ? "none" : recording::NameOf(compression))) continue;
    if (!recording::IsAvailable(compression))
      throw UsageError(option + ": this program was built without " + text);
    return compression;
  }
  RefuseValue(option, "none, lz4 or zstd", text);
}

recording::RangeConvention ParseRanges(const std::string& option, const std::string& text) {
  if (text == "rep117") return recording::RangeConvention::kRep117;
  if (text == "stage") return recording::RangeConvention::kStage;
  RefuseValue(option, "rep117 or stage", text);
}

}  // namespace Stg::program
