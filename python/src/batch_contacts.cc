// SPDX-License-Identifier: GPL-2.0-or-later
//
// The contacts of outlines in the worlds of a batch.

#include <algorithm>

#include "batch.hh"
#include "gil.hh"
#include "world/world.hh"
#include "worlds/pool_access.hh"

namespace Stg::python {

/// The number in the crowd of the robot that a model belongs to, or -1.
int64_t Batch::NumberOfRobot(uint32_t variant, const Model& model) const {
  const Crowd::Robots& robots = crowd_->robots()[variant];
  const auto found = std::ranges::find(robots, model.Root()->GetId(), &ModelKey::id);
  return found == robots.end() ? -1 : found - robots.begin();
}

void Batch::FindContacts(const Indices& which, const ContactArrays& to) {
  const Use use(this);
  const GilRelease no_gil;
  constexpr size_t kBlock = 16;
  pool_->Run((which.size() + kBlock - 1) / kBlock, [&](size_t block, unsigned) {
    std::vector<ContactPoint> found;
    for (size_t i = block * kBlock; i < std::min(which.size(), (block + 1) * kBlock); i++) {
      found.clear();
      if (!PoolAccess::FindContacts(*pool_, which[i], &found))
        PoolAccess::Look(*pool_, which[i], [&](World& world) {
          world.ForEachContact([&](const ContactPoint& contact) { found.push_back(contact); });
        });
      StoreContacts(pool_->Variant(which[i]), found, i * to.most, to);
    }
  });
}

/// Stores the contacts of a world from number `at` on.
void Batch::StoreContacts(uint32_t variant, const std::vector<ContactPoint>& contacts, size_t at,
                          const ContactArrays& to) const {
  for (size_t i = 0; i < std::min(contacts.size(), to.most); i++, at++) {
    const ContactPoint& contact = contacts[i];
    to.models[2 * at] = contact.a->GetId();
    to.models[2 * at + 1] = contact.b->GetId();
    to.robots[2 * at] = NumberOfRobot(variant, *contact.a);
    to.robots[2 * at + 1] = NumberOfRobot(variant, *contact.b);
    const double numbers[] = {contact.point.x, contact.point.y, contact.normal.x, contact.normal.y,
                              contact.gap};
    std::ranges::copy(numbers, to.numbers + 5 * at);
  }
}

}  // namespace Stg::python
