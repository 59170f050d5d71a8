// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/bag.hh"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "messages/log.hh"
#include "recording/mcap_reader.hh"
#include "stage/option_values.hh"
#include "stage/process.hh"

namespace Stg::program {

namespace {

using recording::McapReader;

/// The messages of a channel; times are those of the log, in seconds.
struct Traffic {
  uint64_t messages = 0, bytes = 0;
  double first = 0, last = 0;
};

std::map<uint16_t, Traffic> TrafficOf(const McapReader& log) {
  std::map<uint16_t, Traffic> of_channels;
  recording::Buffer records;
  for (const McapReader::Chunk& chunk : log.chunks()) {
    log.Read(chunk, &records);
    recording::ForEachRecord(records.view(), [&](recording::Op op, std::string_view fields) {
      if (op != recording::Op::kMessage) return;
      const recording::Message message = recording::MessageOf(fields);
      Traffic& traffic = of_channels[message.channel];
      const double time = static_cast<double>(message.time) / 1e9;
      if (traffic.messages++ == 0) traffic.first = time;
      traffic.last = time;
      traffic.bytes += message.data.size();
    });
  }
  return of_channels;
}

std::string Text(const char* format, double number) {
  char text[64];
  std::snprintf(text, sizeof text, format, number);
  return text;
}

/// A size with a fitting unit.
std::string SizeText(uint64_t bytes) {
  if (bytes < 10'000) return std::to_string(bytes) + " B";
  const auto size = static_cast<double>(bytes);
  return size < 1e6 ? Text("%.1f kB", size / 1e3) : Text("%.1f MB", size / 1e6);
}

/// Messages per second; "-" for a single message.
std::string RateText(const Traffic& traffic) {
  const double seconds = traffic.last - traffic.first;
  if (traffic.messages < 2 || !(seconds > 0)) return "-";
  return Text("%.4g", static_cast<double>(traffic.messages - 1) / seconds);
}

using Row = std::vector<std::string>;

/// Rows in columns: two with texts, then numbers.
std::string TextOf(const std::vector<Row>& rows) {
  std::vector<size_t> widths;
  for (const Row& row : rows) {
    widths.resize(row.size());
    for (size_t i = 0; i < row.size(); i++) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const Row& row : rows) {
    for (size_t i = 0; i < row.size(); i++) {
      const std::string padding(widths[i] - row[i].size(), ' ');
      text += (i > 0 ? "  " : "") + (i < 2 ? row[i] + padding : padding + row[i]);
    }
    text += "\n";
  }
  return text;
}

/// The rows of all topics that have messages, in the order of their names.
std::vector<Row> RowsOf(const McapReader& log, const std::map<uint16_t, Traffic>& of_channels) {
  std::vector<Row> rows;
  for (const auto& [id, traffic] : of_channels) {
    const auto found = log.channels().find(id);
    const McapReader::Channel channel =
        found == log.channels().end() ? McapReader::Channel() : found->second;
    rows.push_back({Printable(channel.topic), Printable(channel.type),
                    std::to_string(traffic.messages), RateText(traffic), SizeText(traffic.bytes)});
  }
  std::ranges::sort(rows);
  rows.insert(rows.begin(), {"topic", "type", "messages", "per second", "size"});
  return rows;
}

void PrintInfo(const std::string& file) {
  const McapReader log(file);
  const std::map<uint16_t, Traffic> of_channels = TrafficOf(log);
  Traffic all;
  all.first = std::numeric_limits<double>::infinity();
  for (const auto& [id, traffic] : of_channels) {
    all.messages += traffic.messages;
    all.first = std::min(all.first, traffic.first);
    all.last = std::max(all.last, traffic.last);
  }
  std::string text = Printable(file) + ": " + SizeText(std::filesystem::file_size(file)) + ", " +
                     std::to_string(all.messages) + " messages";
  if (all.messages > 0) text += Text(", %.9g s to ", all.first) + Text("%.9g s", all.last);
  text += log.ends_early() ? "; it ends early, as after a crash\n" : "\n";
  for (const auto& [name, value] : log.metadata("stage"))
    text += Printable(name) + ": " + Printable(value) + "\n";
  PrintWhole(text + TextOf(RowsOf(log, of_channels)));
}

}  // namespace

std::optional<int> RunBagCommand(int argc, char* argv[]) {
  if (argc < 2 || std::string_view(argv[1]) != "bag") return std::nullopt;
  if (argc != 4 || std::string_view(argv[2]) != "info")
    throw UsageError("bag: expected 'stage bag info LOG', with a file that --log has recorded");
  PrintInfo(argv[3]);
  return 0;
}

}  // namespace Stg::program
