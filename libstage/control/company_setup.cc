// SPDX-License-Identifier: GPL-2.0-or-later

#include "control/company_setup.hh"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "geometry/trigonometry.hh"
#include "models/position.hh"
#include "models/ranger.hh"

namespace Stg::control {

double RadiusOf(const ModelPosition& robot) {
  const Geom geom = robot.GetGeom();
  return Hypotenuse(geom.size.x, geom.size.y) / 2;
}

double IntervalOf(const ModelPosition& robot) {
  const usec_t step = std::max<usec_t>(robot.world_base().sim_interval, 1);
  const usec_t steps = (std::max<usec_t>(robot.GetUpdateInterval(), 1) + step - 1) / step;
  return static_cast<double>(steps * step) / 1e6;
}

void UseRangers(ControllerSetup* setup, StockParameters* parameters) {
  while (ModelRanger* const ranger = setup->FindUnusedRanger()) setup->Use(ranger);
  parameters->horizon = kFar;
  parameters->layout = FindRayLayout(setup->sensors(), kFar);
}

std::vector<ControllerNumber> WalkerNumbers(row_walker_t* rule, const ModelPosition& robot) {
  *rule = {.tolerance = 0.2,
           .time = 0.5,
           .turn = 3.0,
           .repulsion = 3.0,
           .reach = 0.3,
           .wall = 10.0,
           .wall_reach = 0.2,
           .behind = 0.5,
           .radius = RadiusOf(robot)};
  return {{"tolerance", &rule->tolerance, kLeastDivisor, 1000},
          {"time", &rule->time, kLeastDivisor, 1000},
          {"turn", &rule->turn, 0, 1000},
          {"repulsion", &rule->repulsion, 0, 1e6},
          {"reach", &rule->reach, kLeastDivisor, 1000},
          {"wall", &rule->wall, 0, 1e6},
          {"wall_reach", &rule->wall_reach, kLeastDivisor, 1000},
          {"behind", &rule->behind, 0, 1},
          {"radius", &rule->radius, 0, 1000}};
}

std::vector<ControllerNumber> EvaderNumbers(row_evader_t* rule, const char* time) {
  *rule = {.time = 3.0, .wall_time = 1.0, .range = 5.0, .most = 10.0};
  return {{time, &rule->time, kLeastDivisor, 1000},
          {"wall_time", &rule->wall_time, kLeastDivisor, 1000},
          {"range", &rule->range, 0, 1e6},
          {"neighbours", &rule->most, 1, ROW_MOST_PLANES}};
}

void RequireWhole(const char* name, double value) {
  if (value == std::floor(value)) return;
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "found \"" << name << "=" << value << "\", expected a whole number";
  throw std::runtime_error(text.str());
}

}  // namespace Stg::control
