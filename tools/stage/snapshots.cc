// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/snapshots.hh"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "files/whole_file.hh"
#include "messages/report.hh"

namespace Stg::program {

namespace {

bool IsSnapshot(std::string_view beginning) { return beginning.starts_with(Snapshot::kMagic); }

std::string WhyNotWritten(const std::string& file, int error) {
  return "--save-snapshot: " + messages::Quoted(file) + " can't be written: " +
         (error == EEXIST ? "it exists and is not a snapshot" : std::strerror(error));
}

bool Refuse(const std::string& what) {
  messages::Report(LogLevel::kError, "stage: " + what);
  return false;
}

}  // namespace

SnapshotSaver::SnapshotSaver(const Options::SnapshotOrder& order)
    : order_(order), place_(files::AbsolutePath(order.file)) {
  if (const int error = files::TryReplaceFile(place_, IsSnapshot); error != 0)
    throw UsageError(WhyNotWritten(order_.file, error));
}

void SnapshotSaver::SaveIfDue(World* world) {
  if (done_ || world->SimTimeNow() < order_.time) return;
  Snapshot snapshot;
  if (!world->Take(&snapshot)) std::exit(EXIT_FAILURE);  // Take() has reported the reason
  std::ostringstream content;
  snapshot.Write(content);
  if (const int error = files::ReplaceFile(place_, content.view(), IsSnapshot); error != 0)
    throw std::runtime_error(WhyNotWritten(order_.file, error));
  done_ = true;
}

int SnapshotSaver::ReportEarlyEnd(const std::vector<LoadedWorld>& worlds) const {
  const auto seconds = [](usec_t time) { return std::to_string(static_cast<double>(time) / 1e6); };
  Refuse("--save-snapshot: the run ended at " + seconds(worlds.front().world->SimTimeNow()) +
         " s, before the snapshot's time, " + seconds(order_.time) + " s; nothing was written");
  return EXIT_FAILURE;
}

std::optional<SnapshotSaver> OpenSaver(const Options& options) {
  if (!options.snapshot) return std::nullopt;
  return SnapshotSaver(*options.snapshot);
}

bool StartFromSnapshot(const Options& options, const std::vector<LoadedWorld>& worlds) {
  const std::string& file = options.first_snapshot;
  if (file.empty()) return true;
  std::ifstream in(file, std::ios::binary);
  if (!in)
    return Refuse("--from-snapshot: " + messages::Quoted(file) +
                  " can't be read: " + std::strerror(errno));
  Snapshot snapshot;
  return snapshot.Read(in, messages::Quoted(file)) && worlds.front().world->Restore(snapshot);
}

}  // namespace Stg::program
