// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/ordered_judge.hh"

namespace Stg::whatif {

bool OrderedJudge::WatchSample(const Sighting* watched, const Sample& sample,
                               SampleResult* result) {
  thread_local std::vector<Sighting> ordered;
  ordered.clear();
  for (const uint32_t place : order_of_(sample.number)) ordered.push_back(watched[place]);
  return judge_.WatchSample(ordered.data(), sample, result);
}

void OrderedJudge::Order(uint32_t sample, std::vector<Sighting>* sightings) const {
  const std::vector<uint32_t>& order = order_of_(sample);
  std::vector<Sighting> step(watched_);
  for (size_t first = 0; first + watched_ <= sightings->size(); first += watched_) {
    for (size_t i = 0; i < watched_; i++) step[i] = (*sightings)[first + order[i]];
    for (size_t i = 0; i < watched_; i++) (*sightings)[first + i] = step[i];
  }
}

void OrderedJudge::ScoreFutures(const Future* futures, size_t count, SampleResult* results) {
  std::vector<std::vector<Sighting>> sightings(count);
  std::vector<Future> ordered(futures, futures + count);
  for (size_t i = 0; i < count; i++) {
    sightings[i].assign(futures[i].sightings, futures[i].sightings + futures[i].steps * watched_);
    Order(futures[i].sample.number, &sightings[i]);
    ordered[i].sightings = sightings[i].data();
  }
  judge_.ScoreFutures(ordered.data(), count, results);
}

}  // namespace Stg::whatif
