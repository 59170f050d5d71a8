// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/route_setup.hh"

#include <cmath>
#include <limits>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <string>

#include "control/company_setup.hh"
#include "messages/report.hh"

namespace Stg::control {

namespace {

constexpr char kGoals[] = "goals=";

[[noreturn]] void RefuseGoals(const std::string& word) {
  throw std::runtime_error("found " + messages::Quoted(word) +
                           ", expected goals=X,Y,X,Y,... with 1 to " +
                           std::to_string(ROW_MOST_GOALS) + " goals in metres");
}

/// Reads a coordinate and what separates it from the next one.
double ReadCoordinate(std::istringstream* stream, const std::string& word) {
  double value = 0;
  if (!(*stream >> value) || !(std::abs(value) <= kFar)) RefuseGoals(word);
  if (!stream->eof() && stream->get() != ',') RefuseGoals(word);
  return value;
}

void ReadGoals(const std::string& word, row_route_t* route) {
  std::istringstream stream(word.substr(sizeof kGoals - 1));
  stream.imbue(std::locale::classic());
  int count = 0;
  do {
    if (count == ROW_MOST_GOALS) RefuseGoals(word);
    const double x = ReadCoordinate(&stream, word);
    if (stream.eof()) RefuseGoals(word);
    route->goals[count++] = {x, ReadCoordinate(&stream, word)};
  } while (!stream.eof());
  route->count = count;
}

}  // namespace

void ReadRoute(const ControllerSetup& setup, std::vector<ControllerNumber> numbers,
               row_route_t* route) {
  constexpr double kRequired = std::numeric_limits<double>::quiet_NaN();
  *route = {.goals = {}, .count = 0, .loop = 0, .wait = 0, .vicinity = 0.5};
  std::string others = "stage";  // the name of the controller is not read
  for (const std::string& word : setup.words()) {
    if (word.starts_with(kGoals))
      ReadGoals(word, route);
    else
      others += " " + word;
  }
  numbers.insert(numbers.end(), {{"loop", &route->loop, 0, 1},
                                 {"wait", &route->wait, 0, 1e9},
                                 {"near", &route->vicinity, kLeastDivisor, 1000}});
  if (route->count == 0) {
    route->count = 1;
    route->goals[0] = {kRequired, kRequired};
    numbers.insert(numbers.begin(), {{"x", &route->goals[0].x, -kFar, kFar},
                                     {"y", &route->goals[0].y, -kFar, kFar}});
  }
  ControllerSetup(&setup.robot(), others).ReadNumbers(numbers);
  RequireWhole("loop", route->loop);
}

std::vector<ControllerNumber> GroupNumbers(row_group_t* group) {
  *group = {.size = 1, .member = 1, .gaze = 4, .cohesion = 3, .push = 1, .unused = 0};
  return {{"group", &group->size, 1, 1000},
          {"member", &group->member, 1, 1000},
          {"gaze", &group->gaze, 0, 1000},
          {"cohesion", &group->cohesion, 0, 1000},
          {"push", &group->push, 0, 1000}};
}

void CheckGroup(const row_group_t& group) {
  RequireWhole("group", group.size);
  RequireWhole("member", group.member);
  if (group.member <= group.size) return;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "found member=" << group.member << " of group=" << group.size
       << ", expected a number from 1 to " << group.size;
  throw std::runtime_error(text.str());
}

}  // namespace Stg::control
