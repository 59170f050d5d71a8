// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lights that the robots of a fleet carry, as arrays.

#include <nanobind/ndarray.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bindings.hh"
#include "crowd.hh"
#include "failure.hh"
#include "model_handle.hh"
#include "simulation.hh"

namespace Stg::python {

namespace {

using Truths = nb::ndarray<bool, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using ConstTruths = nb::ndarray<const bool, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
using ConstNumbers = nb::ndarray<const double, nb::shape<-1, -1>, nb::c_contig, nb::device::cpu>;
constexpr size_t kColorParts = 4;  // red, green, blue and opacity

bool CanBeSwitched(const Model& model) {
  return dynamic_cast<const ModelLight*>(&model) ||
         dynamic_cast<const ModelLightIndicator*>(&model);
}

/// Light number `n` of a tree, counted down on the way, or null.
Model* FindLight(Model* model, size_t* n) {
  if (CanBeSwitched(*model) && (*n)-- == 0) return model;
  for (Model* child : model->GetChildren())
    if (Model* const found = FindLight(child, n)) return found;
  return nullptr;
}

/// Light number `index` of each robot; null for those that have none.
std::vector<Model*> LightsOf(Simulation& simulation, Crowd& crowd, size_t index) {
  std::vector<Model*> lights;
  bool any = false;
  for (ModelPosition* robot : crowd.RobotsOf(simulation, 0)) {
    size_t n = index;
    lights.push_back(robot ? FindLight(robot, &n) : nullptr);
    any = any || lights.back();
  }
  if (!any) throw Failure{Kind::kGone, "no robot has a light number " + std::to_string(index)};
  return lights;
}

void SwitchLights(Simulation& simulation, Crowd& crowd, size_t index, const ConstTruths& on,
                  const ConstTruths& which) {
  if (on.shape(0) != crowd.size() || which.shape(0) != crowd.size())
    throw nb::value_error("found another number of values than there are robots");
  simulation.With([&](World&) {
    const std::vector<Model*> lights = LightsOf(simulation, crowd, index);
    for (size_t i = 0; i < lights.size(); i++)
      if (lights[i] && which.data()[i]) SwitchLight(*lights[i], on.data()[i]);
  });
}

void ReadLights(Simulation& simulation, Crowd& crowd, size_t index, const Truths& on) {
  if (on.shape(0) != crowd.size())
    throw nb::value_error("found another number of values than there are robots");
  simulation.With([&](World&) {
    const std::vector<Model*> lights = LightsOf(simulation, crowd, index);
    for (size_t i = 0; i < lights.size(); i++)
      on.data()[i] = lights[i] && dynamic_cast<const LightSource&>(*lights[i]).IsOn();
  });
}

/// One number or the parts of a colour for each robot.
template <typename Array>
bool AreForAll(const Array& numbers, const Crowd& crowd) {
  return numbers.shape(0) == crowd.size() &&
         (numbers.shape(1) == 1 || numbers.shape(1) == kColorParts);
}

/// Sets the intensity of the lights, or, with four numbers each, their colours.
void SetLights(Simulation& simulation, Crowd& crowd, size_t index, const ConstNumbers& numbers,
               const ConstTruths& which) {
  if (!AreForAll(numbers, crowd) || which.shape(0) != crowd.size())
    throw nb::value_error("found another number of values than there are robots");
  const bool are_colors = numbers.shape(1) == kColorParts;
  simulation.With([&](World&) {
    std::vector<Model*> lights = LightsOf(simulation, crowd, index);
    for (size_t i = 0; i < lights.size(); i++) {
      if (!which.data()[i]) lights[i] = nullptr;
      if (lights[i] && !are_colors) As<ModelLight>(*lights[i], "light");  // else nothing is set
    }
    for (size_t i = 0; i < lights.size(); i++) {
      if (!lights[i]) continue;
      const double* n = numbers.data() + i * numbers.shape(1);
      if (are_colors)
        lights[i]->SetColor(Color(n[0], n[1], n[2], n[3]));
      else
        As<ModelLight>(*lights[i], "light").SetIntensity(n[0]);
    }
  });
}

/// The intensity of the lights, or, with four numbers each, their colours; NaN for none.
void ReadLightNumbers(Simulation& simulation, Crowd& crowd, size_t index, const Numbers& numbers) {
  if (!AreForAll(numbers, crowd))
    throw nb::value_error("found another number of values than there are robots");
  const bool are_colors = numbers.shape(1) == kColorParts;
  simulation.With([&](World&) {
    const std::vector<Model*> lights = LightsOf(simulation, crowd, index);
    for (size_t i = 0; i < lights.size(); i++) {
      double* n = numbers.data() + i * numbers.shape(1);
      std::fill_n(n, numbers.shape(1), std::nan(""));
      if (!lights[i]) continue;
      const Color color = lights[i]->GetColor();
      const double parts[kColorParts] = {color.r, color.g, color.b, color.a};
      if (are_colors)
        std::copy_n(parts, kColorParts, n);
      else
        n[0] = dynamic_cast<const LightSource&>(*lights[i]).GetIntensity();
    }
  });
}

}  // namespace

bool SwitchLight(Model& model, bool on) {
  if (auto* const indicator = dynamic_cast<ModelLightIndicator*>(&model))
    indicator->SetState(on);
  else if (auto* const light = dynamic_cast<ModelLight*>(&model))
    light->SetOn(on);
  else
    return false;
  return true;
}

void BindLight(nb::class_<Simulation>& world) {
  world
      .def("switch_lights", &SwitchLights, nb::arg("crowd"), nb::arg("index"), nb::arg("on"),
           nb::arg("which"))
      .def("set_lights", &SetLights, nb::arg("crowd"), nb::arg("index"), nb::arg("numbers"),
           nb::arg("which"))
      .def("read_light_numbers", &ReadLightNumbers, nb::arg("crowd"), nb::arg("index"),
           nb::arg("numbers"))
      .def("read_lights", &ReadLights, nb::arg("crowd"), nb::arg("index"), nb::arg("on"));
}

}  // namespace Stg::python
