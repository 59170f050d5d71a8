// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/option_values.hh"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "stage/parse_number.hh"

namespace Stg::program {

void RefuseValue(const std::string& option, const std::string& expected, const std::string& found) {
  throw UsageError(option + ": found '" + found + "', expected " + expected);
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
