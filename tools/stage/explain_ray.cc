// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/explain_ray.hh"

#include <algorithm>
#include <cmath>
#include <optional>

#include "messages/report.hh"
#include "models/model.hh"
#include "stage/format.hh"
#include "stage/interrupt.hh"
#include "stage/parse_number.hh"
#include "stage/process.hh"
#include "stage/report.hh"
#include "stage/run.hh"

namespace Stg::program {

namespace {

constexpr char kForm[] = "ROBOT:RANGER:SENSOR:SAMPLE@SECONDS, as r0:0:0:90@12.5";
constexpr double kMaxSeconds = 1e12;

[[noreturn]] void Refuse(const std::string& text) {
  throw UsageError("--explain-ray: found " + messages::Quoted(text) + ", expected " + kForm);
}

/// Removes the last `separator` and what follows from the text, and returns what follows.
std::string CutLast(std::string* text, char separator, const std::string& whole) {
  const size_t at = text->rfind(separator);
  if (at == std::string::npos) Refuse(whole);
  std::string part = text->substr(at + 1);
  text->resize(at);
  return part;
}

template <typename Number>
Number NumberIn(const std::string& text, const std::string& whole) {
  const std::optional<Number> number = ParseNumber<Number>(text);
  if (!number) Refuse(whole);
  return *number;
}

double SecondsIn(const std::string& text, const std::string& whole) {
  const double seconds = NumberIn<double>(text, whole);
  if (!(seconds >= 0 && seconds <= kMaxSeconds)) Refuse(whole);
  return seconds;
}

void AppendRangers(Model& model, std::vector<ModelRanger*>* rangers) {
  if (auto* ranger = dynamic_cast<ModelRanger*>(&model)) rangers->push_back(ranger);
  for (Model* child : model.GetChildren()) AppendRangers(*child, rangers);
}

std::vector<ModelRanger*> RangersOf(const World& world) {
  std::vector<ModelRanger*> rangers;
  for (Model* child : world.GetChildren()) AppendRangers(*child, &rangers);
  return rangers;
}

/// Finds a ranger by index in the robot, by full name, or by the part after the robot's name.
ModelRanger* RangerOf(Model* robot, const std::string& which) {
  std::vector<ModelRanger*> rangers;
  AppendRangers(*robot, &rangers);
  if (const std::optional<size_t> number = ParseNumber<size_t>(which))
    return *number < rangers.size() ? rangers[*number] : nullptr;
  for (ModelRanger* ranger : rangers)
    if (ranger->TokenStr() == which || ranger->TokenStr() == robot->TokenStr() + "." + which)
      return ranger;
  return nullptr;
}

Model* FindModel(const World& world, const std::string& name) {
  for (Model* model : world.GetAllModels())
    if (model->TokenStr() == name) return model;
  return nullptr;
}

std::string SomeNames(const std::vector<ModelRanger*>& rangers) {
  constexpr size_t kMaxNamed = 5;
  if (rangers.empty()) return "there is no ranger in this world";
  std::string names;
  for (size_t i = 0; i < std::min(kMaxNamed, rangers.size()); i++)
    names += (i > 0 ? ", " : "") + messages::Quoted(rangers[i]->TokenStr());
  return "the rangers are " + names + (rangers.size() > kMaxNamed ? " ..." : "");
}

void CheckSample(const ModelRanger& ranger, const RayChoice& choice) {
  const auto& sensors = ranger.GetSensors();
  const std::string name = messages::Quoted(ranger.TokenStr());
  if (choice.sensor >= sensors.size())
    throw UsageError("--explain-ray: found sensor " + std::to_string(choice.sensor) + ", but " +
                     name + " has " + std::to_string(sensors.size()) + ", counted from 0");
  const unsigned samples = sensors[choice.sensor].sample_count;
  if (choice.sample >= samples)
    throw UsageError("--explain-ray: found sample " + std::to_string(choice.sample) +
                     ", but sensor " + std::to_string(choice.sensor) + " of " + name + " has " +
                     std::to_string(samples) + ", counted from 0");
}

/// Steps the world to this time, or to its end if that is earlier.
void RunTo(World* world, double seconds) {
  const auto time = static_cast<usec_t>(std::llround(seconds * 1e6));
  while (CaughtSignal() == 0 && world->SimTimeNow() + world->sim_interval <= time)
    if (world->Update()) break;
}

}  // namespace

RayChoice ParseRayChoice(const std::string& text) {
  RayChoice choice;
  choice.ranger = text;
  choice.seconds = SecondsIn(CutLast(&choice.ranger, '@', text), text);
  choice.sample = NumberIn<uint32_t>(CutLast(&choice.ranger, ':', text), text);
  choice.sensor = NumberIn<uint32_t>(CutLast(&choice.ranger, ':', text), text);
  if (choice.ranger.empty()) Refuse(text);
  return choice;
}

ModelRanger* FindRanger(const World& world, const std::string& name) {
  if (Model* model = FindModel(world, name)) {
    std::vector<ModelRanger*> rangers;
    AppendRangers(*model, &rangers);
    if (dynamic_cast<ModelRanger*>(model) || rangers.size() == 1) return rangers[0];
    throw UsageError("--explain-ray: found " + std::to_string(rangers.size()) + " rangers of " +
                     messages::Quoted(name) + ", expected one, or which: " + kForm);
  }
  // Names may contain colons, so each colon may be the one between robot and ranger.
  for (size_t at = name.find(':'); at != std::string::npos; at = name.find(':', at + 1)) {
    Model* const robot = FindModel(world, name.substr(0, at));
    ModelRanger* const ranger = robot ? RangerOf(robot, name.substr(at + 1)) : nullptr;
    if (ranger) return ranger;
  }
  throw UsageError("--explain-ray: found no ranger " + messages::Quoted(name) + "; " +
                   SomeNames(RangersOf(world)));
}

int ExplainRay(const Options& options) {
  const RayChoice choice = ParseRayChoice(options.explained_ray);
  if (options.worldfiles.size() != 1)
    throw UsageError("--explain-ray: found " + std::to_string(options.worldfiles.size()) +
                     " world files, expected one");
  const std::optional<ReportFile> report = OpenReport(options);
  static std::vector<LoadedWorld>& worlds = *new std::vector<LoadedWorld>;  // not deleted
  ExplainedRay explained{nullptr, choice.sensor, choice.sample, {}};
  {
    const OutputToError redirected;  // messages of loading and of controllers
    if (const int status = LoadWorlds(options, &worlds); status != 0) return status;
    World* const world = worlds.front().world;
    const ModelRanger* const ranger = FindRanger(*world, choice.ranger);
    CheckSample(*ranger, choice);
    const RayWatch watch(world, *ranger, choice.sensor, choice.sample);
    CatchSignals();
    RunTo(world, choice.seconds);
    if (!watch.last())
      throw std::runtime_error(
          "--explain-ray: " + messages::Quoted(ranger->TokenStr()) + " has not updated by " +
          Format("%g s: ", static_cast<double>(world->SimTimeNow()) / 1e6) +
          (ranger->HasSubscribers() ? "its first update comes later"
                                    : "nobody subscribes to it; `alwayson 1` makes it run"));
    explained.ranger = ranger;
    explained.ray = *watch.last();
  }
  PrintUnlessReport(report, RayText(explained));
  if (report) report->Write(RayJson(explained));
  return CaughtSignal() != 0 ? RaiseDefault(CaughtSignal()) : 0;
}

}  // namespace Stg::program
