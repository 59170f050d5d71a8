// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/log_entry.hh"

#include <cstdio>
#include <mutex>

#include "models/host.hh"
#include "models/model.hh"

namespace Stg {

std::vector<LogEntry> LogEntry::log;

namespace {
std::mutex log_mutex;  // several threads may run worlds
}

LogEntry::LogEntry(usec_t timestamp, Model* mod)
    : timestamp_(timestamp), model_id_(mod->GetId()), pose_(mod->GetPose()) {
  if (!mod->host().listed) return;
  const std::lock_guard<std::mutex> lock(log_mutex);
  log.push_back(*this);
}

size_t LogEntry::Count() {
  const std::lock_guard<std::mutex> lock(log_mutex);
  return log.size();
}

void LogEntry::Clear() {
  const std::lock_guard<std::mutex> lock(log_mutex);
  log.clear();
}

void LogEntry::Print() {
  const std::lock_guard<std::mutex> lock(log_mutex);
  for (const LogEntry& entry : log)
    std::printf("%.3f\t%u\t%s\n", static_cast<double>(entry.timestamp_) / 1e6, entry.model_id_,
                entry.pose_.String().c_str());
}

}  // namespace Stg
