// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/calls.hh"

namespace Stg::cl::calls {

namespace {

// Trivially destructible, because drivers are called until the very end of the process.
std::array<Record, 64> g_records;
Record g_spare;  // shared by threads without a record; never read

// The calling thread's record. A plain pointer, which stays usable after the thread's destructors.
thread_local Record* t_record = nullptr;

/// Releases a thread's record when the thread ends.
struct RecordOwner {
  Record* record = nullptr;
  ~RecordOwner() {
    t_record = &g_spare;
    if (record) record->taken = false;
  }
};

Record* TakeRecord() {
  thread_local RecordOwner seat;
  for (Record& record : g_records) {
    bool taken = false;
    if (!record.taken.compare_exchange_strong(taken, true)) continue;
    record.thread = pthread_self();
    return seat.record = &record;
  }
  return &g_spare;
}

}  // namespace

std::array<Record, 64>& Records() { return g_records; }

Record& RecordOfThisThread() {
  if (!t_record) t_record = TakeRecord();
  return *t_record;
}

void RedirectThisThread(Record* record) {
  record->thread = pthread_self();
  t_record = record;
}

void SetDriver(const std::string& name) {
  std::array<std::atomic<char>, 128>& driver = RecordOfThisThread().driver;
  const std::size_t length = std::min(name.size(), driver.size() - 1);
  for (std::size_t i = 0; i < length; i++) driver[i].store(name[i], std::memory_order_relaxed);
  driver[length].store('\0', std::memory_order_relaxed);
}

void CopyDriver(const Record& record, char (*name)[128]) {
  for (std::size_t i = 0; i < sizeof *name; i++)
    (*name)[i] = record.driver[i].load(std::memory_order_relaxed);
  (*name)[sizeof *name - 1] = '\0';
}

}  // namespace Stg::cl::calls
