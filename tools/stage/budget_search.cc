// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/budget_search.hh"

#include <algorithm>
#include <vector>

#include "stage/console.hh"
#include "stage/format.hh"
#include "stage/status_line.hh"
#include "threads/wall_clock.hh"

namespace Stg::program {

namespace {

constexpr uint32_t kMostOfAll = 100000;

class Search {
 public:
  Search(double seconds, const std::function<double(uint32_t)>& seconds_of, std::string noun,
         bool shows_progress)
      : seconds_(seconds),
        end_(threads::WallClock() + std::max(8.0, 4 * seconds)),
        seconds_of_(seconds_of),
        noun_(std::move(noun)),
        shows_progress_(shows_progress) {}

  Fit Go() {
    uint32_t more = 1;  // does not fit, once the loop below has ended with time left
    bool fits = true;
    while (more < kMostOfAll && HasTime() && (fits = Fits(more))) {
      // The number that would fit at the measured rate, but at most twice the last one.
      const double guess = more * seconds_ / std::max(fit_.seconds, 1e-9);
      more = std::min(2 * more, std::max(more + 1, static_cast<uint32_t>(std::min(guess, 1e9))));
    }
    while (!fits && IsWide(more) && HasTime()) {
      const uint32_t middle = fit_.count + (more - fit_.count) / 2;
      if (!Fits(middle)) more = middle;
    }
    fit_.is_lower_bound = fits || IsWide(more);
    line_.Erase();
    return fit_;
  }

 private:
  /// True if the interval is wider than 1 %, because timings vary by more than that.
  bool IsWide(uint32_t more) const { return fit_.count + fit_.count / 100 + 1 < more; }
  bool HasTime() const { return threads::WallClock() < end_; }
  bool Fits(uint32_t count) {
    if (shows_progress_)
      line_.Print(Format(" %u %s fit; trying %u", fit_.count, noun_.c_str(), count));
    const double time = seconds_of_(count);
    if (time > seconds_) return false;
    fit_.count = count;
    fit_.seconds = time;
    return true;
  }

  const double seconds_, end_;
  const std::function<double(uint32_t)>& seconds_of_;
  const std::string noun_;
  const bool shows_progress_;
  Fit fit_;
  StatusLine line_;
};

}  // namespace

double MedianSeconds(const std::function<double()>& measure) {
  constexpr size_t kMostTries = 5;
  constexpr double kMostTime = 0.5;  // seconds after which no further try begins
  std::vector<double> seconds;
  const double start = threads::WallClock();
  do seconds.push_back(measure());
  while (seconds.size() < kMostTries && threads::WallClock() - start < kMostTime);
  std::ranges::sort(seconds);
  return seconds[(seconds.size() - 1) / 2];
}

Fit SearchFit(double seconds, const std::function<double(uint32_t)>& seconds_of,
              const std::string& noun, bool shows_progress) {
  return Search(seconds, seconds_of, noun, shows_progress).Go();
}

}  // namespace Stg::program
