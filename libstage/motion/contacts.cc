// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/contacts.hh"

#include "messages/assert.hh"

namespace Stg::motion {

void Contacts::Begin(const Shapes& shapes, const Walls& walls, Columns* columns, size_t threads) {
  nearby_.Find(shapes, walls, *columns);
  for (size_t i = 0; i < columns->size(); i++) {
    if (nearby_.place[i] != Nearby::kNone) continue;
    columns->x[i] = columns->target_x[i];
    columns->y[i] = columns->target_y[i];
    columns->heading[i] = columns->target_heading[i];
    columns->made[i] = 1.0;
  }
  if (workers_.size() < threads) workers_.resize(threads);
  for (Worker& worker : workers_) worker.contacts.clear();
  ranges_.assign(nearby_.islands.size(), {0, 0, 0});
}

void Contacts::Solve(const Shapes& shapes, const Walls& walls, size_t island, size_t thread,
                     Columns* columns) {
  STAGE_ASSERT(island < ranges_.size() && thread < workers_.size());
  Worker& worker = workers_[thread];
  const size_t first = worker.contacts.size();
  worker.solver.Solve(shapes, walls, nearby_, nearby_.islands[island], effort, columns,
                      tell ? &worker.contacts : nullptr);
  ranges_[island] = {thread, first, worker.contacts.size()};
}

void Contacts::End() {
  contacts_.clear();
  for (const Range& range : ranges_) {
    const std::vector<Contact>& from = workers_[range.worker].contacts;
    contacts_.insert(contacts_.end(), from.begin() + static_cast<std::ptrdiff_t>(range.first),
                     from.begin() + static_cast<std::ptrdiff_t>(range.last));
  }
}

void Contacts::FindContacts(const Shapes& shapes, const Walls& walls, const Columns& columns) {
  constexpr double kAny = 1e-9;  // m; all pairs that are in contact are found with any reach
  nearby_.Find(shapes, walls, columns, kAny);
  if (workers_.empty()) workers_.resize(1);
  contacts_.clear();
  for (const Island& island : nearby_.islands)
    workers_[0].solver.FindContacts(shapes, walls, nearby_, island, columns, &contacts_);
}

void Contacts::Step(const Shapes& shapes, const Walls& walls, Columns* columns) {
  Begin(shapes, walls, columns);
  for (size_t island = 0; island < island_count(); island++)
    Solve(shapes, walls, island, 0, columns);
  End();
}

}  // namespace Stg::motion
