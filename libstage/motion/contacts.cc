// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/contacts.hh"

#include <algorithm>

namespace Stg::motion {

namespace {
constexpr size_t kBodyGrain = 256;
}  // namespace

/// Moves bodies that are in no island to their targets.
void Contacts::MoveFree(size_t begin, size_t end, Columns* columns) const {
  for (size_t i = begin; i < end; i++) {
    if (nearby_.place[i] != Nearby::kNone) continue;
    columns->x[i] = columns->target_x[i];
    columns->y[i] = columns->target_y[i];
    columns->heading[i] = columns->target_heading[i];
    columns->made[i] = 1.0;
  }
}

/// For several threads, the largest islands come first, because the last one keeps a thread busy
/// while the others wait.
void Contacts::OrderIslands(bool by_size) {
  const auto size = [this](uint32_t i) {
    return nearby_.islands[i].last_member - nearby_.islands[i].first_member;
  };
  order_.resize(nearby_.islands.size());
  for (size_t i = 0; i < order_.size(); i++) order_[i] = static_cast<uint32_t>(i);
  if (!by_size) return;
  std::sort(order_.begin(), order_.end(),
            [&](uint32_t a, uint32_t b) { return size(a) != size(b) ? size(a) > size(b) : a < b; });
}

void Contacts::Solve(const Shapes& shapes, const Walls& walls, size_t island, unsigned thread,
                     Columns* columns) {
  Worker& worker = workers_[thread];
  const size_t first = worker.contacts.size();
  worker.solver.Solve(shapes, walls, nearby_, nearby_.islands[island], effort, columns,
                      tell ? &worker.contacts : nullptr);
  ranges_[island] = {thread, first, worker.contacts.size()};
}

void Contacts::CollectContacts() {
  contacts_.clear();
  for (const Range& range : ranges_) {
    const std::vector<Contact>& from = workers_[range.worker].contacts;
    contacts_.insert(contacts_.end(), from.begin() + static_cast<std::ptrdiff_t>(range.first),
                     from.begin() + static_cast<std::ptrdiff_t>(range.last));
  }
}

void Contacts::Step(const Shapes& shapes, const Walls& walls, Columns* columns,
                    threads::WorkerPool* workers) {
  nearby_.Find(shapes, walls, *columns, workers);
  threads::RunOn(workers, columns->size(), kBodyGrain,
                 [&](size_t begin, size_t end, unsigned) { MoveFree(begin, end, columns); });
  const size_t threads = workers != nullptr ? workers->threads() : 1;
  if (workers_.size() < threads) workers_.resize(threads);
  for (Worker& worker : workers_) worker.contacts.clear();
  ranges_.resize(nearby_.islands.size());
  OrderIslands(workers != nullptr);
  threads::RunOn(workers, order_.size(), 1, [&](size_t begin, size_t end, unsigned thread) {
    for (size_t i = begin; i < end; i++) Solve(shapes, walls, order_[i], thread, columns);
  });
  CollectContacts();
}

void Contacts::FindContacts(const Shapes& shapes, const Walls& walls, const Columns& columns) {
  constexpr double kAny = 1e-9;  // m; all pairs that are in contact are found with any reach
  nearby_.Find(shapes, walls, columns, nullptr, kAny);
  if (workers_.empty()) workers_.resize(1);
  contacts_.clear();
  for (const Island& island : nearby_.islands)
    workers_[0].solver.FindContacts(shapes, walls, nearby_, island, columns, &contacts_);
}

}  // namespace Stg::motion
