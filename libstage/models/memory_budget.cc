// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/memory_budget.hh"

#include <cmath>

#include "worldfile/worldfile.hh"

namespace Stg {

void MemoryBudget::Take(const Worldfile& wf, int entity, const char* property, std::size_t count,
                        double bytes_each, const std::string& things) {
  const double bytes = static_cast<double>(count) * bytes_each;
  const double taken = (accumulates_ ? used_bytes_ : 0) + bytes;
  if (taken > max_bytes_)
    wf.Fail(entity, property,
            "found " + std::to_string(count) + " " + things + ", with which the world takes " +
                std::to_string(std::llround(std::ceil(taken / 1e6))) + " MB, expected at most " +
                std::to_string(std::llround(max_bytes_ / 1e6)) + " MB (memory_limit) in all");
  if (accumulates_) used_bytes_ = taken;
}

}  // namespace Stg
