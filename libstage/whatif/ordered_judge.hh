// SPDX-License-Identifier: GPL-2.0-or-later
//
// Passes on the sightings of a belief's samples in the order of the others' ids. Models of others
// are in another order if their hypotheses need different ones.

#ifndef STAGE_WHATIF_ORDERED_JUDGE_HH
#define STAGE_WHATIF_ORDERED_JUDGE_HH

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "whatif/consequence_engine.hh"

namespace Stg::whatif {

class OrderedJudge : public Judge {
 public:
  /// Returns the places of sightings of a sample among the watched models.
  using OrderOf = std::function<const std::vector<uint32_t>&(uint32_t sample)>;

  OrderedJudge(Judge* judge, size_t watched, OrderOf order_of)
      : judge_(*judge), watched_(watched), order_of_(std::move(order_of)) {}

  bool NeedsWorld() const override { return false; }
  bool WatchSample(const Sighting* watched, const Sample& sample, SampleResult* result) override;
  void BeginDecision(const DecisionTask& task) override { judge_.BeginDecision(task); }
  bool ScoresFutures() const override { return judge_.ScoresFutures(); }
  void ScoreFutures(const Future* futures, size_t count, SampleResult* results) override;
  Bounds Outlook(uint64_t steps) const override { return judge_.Outlook(steps); }

  /// Puts the sightings of all steps of a sample into order.
  void Order(uint32_t sample, std::vector<Sighting>* sightings) const;

 private:
  Judge& judge_;
  const size_t watched_;
  const OrderOf order_of_;
};

}  // namespace Stg::whatif

#endif
