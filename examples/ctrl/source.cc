// SPDX-License-Identifier: GPL-2.0-or-later
//
// source: on a zone that flags are taken from. Makes one flag in each update of the model, until it
// holds as many as it has room for.
//
//   ctrl "source 10"
//
// The argument is that number; further ones are ignored. Refused if it is missing, or not a
// number from 1 to 1000000.

#include <deque>

#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

const Stg::Color kYellow(1, 1, 0);
constexpr double kFlagSize = 0.25;  // m

/// They live as long as the world's ground: nobody says when a flag is of no use any more.
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
