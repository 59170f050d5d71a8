// SPDX-License-Identifier: GPL-2.0-or-later
//
// source: a zone that flags are taken from. Creates one flag in each update of the model, up to its
// capacity.
//
//   ctrl "source 10"
//
// The argument is the capacity, a number from 1 to 1000000. Further arguments are ignored.

#include <deque>

#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

const Stg::Color kYellow(1, 1, 0);
constexpr double kFlagSize = 0.25;  // m

/// Flags live as long as the world's ground, because it is unknown when one is no longer used.
using Flags = std::deque<Stg::Model::Flag>;

struct Zone {
  Stg::Model* model = nullptr;
  double capacity = 0;
  Flags* flags = nullptr;
};

void Produce(Zone* zone) {
  if (zone->model->GetFlagCount() < zone->capacity)
    zone->model->PushFlag(&zone->flags->emplace_back(kYellow, kFlagSize));
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Zone* zone = ctrl::NewRobot<Zone>("source", model);
  zone->model = model;
  zone->flags =
      ctrl::SharedInWorld<Flags>(model->GetWorld(), "source flags", [] { return Flags(); });
  const std::vector<std::string> words = ctrl::SplitWords(args->worldfile);
  if (words.size() < 2 || !ctrl::ReadNumber(words[1], {"capacity", &zone->capacity, 1, 1000000}))
    ctrl::GiveUp("source", *model,
                 "found \"" + args->worldfile +
                     "\", expected a number of flags from 1 to 1000000, as in \"source 10\"");
  ctrl::CallOnUpdate<Zone, Produce>(model, zone);
  model->Subscribe();
  return 0;
}
