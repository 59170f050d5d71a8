// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/log_entry.hh"

#include <cstdio>

#include "models/model.hh"

namespace Stg {

std::vector<LogEntry> LogEntry::log;

LogEntry::LogEntry(usec_t timestamp, Model* mod)
    : timestamp_(timestamp), model_id_(mod->GetId()), pose_(mod->GetPose()) {
  log.push_back(*this);
}

void LogEntry::Print() {
  for (const LogEntry& entry : log)
    std::printf("%.3f\t%u\t%s\n", static_cast<double>(entry.timestamp_) / 1e6, entry.model_id_,
                entry.pose_.String().c_str());
}

}  // namespace Stg
