// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/model_choices.hh"

#include <string>

#include "messages/report.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

template <typename Choice>
Choice ReadChoice(Worldfile* wf, int entity, const char* property, const ChoiceNames& names,
                  Choice fallback) {
  if (!wf->PropertyExists(entity, property)) return fallback;
  const std::string name = wf->ReadString(entity, property, "");
  for (size_t i = 0; i < names.size(); i++)
    if (name == names[i]) return static_cast<Choice>(i + 1);
  wf->Fail(entity, property,
           "found " + messages::Quoted(name) + ", expected \"" + names[0] + "\" or \"" + names[1] +
               "\"");
}

}  // namespace

RayModel ReadRayModel(Worldfile* wf, int entity, RayModel fallback) {
  return ReadChoice(wf, entity, "ray_model", kRayModels, fallback);
}

ContactModel ReadContactModel(Worldfile* wf) {
  return ReadChoice(wf, 0, "contacts", kContactModels, ContactModel::kDefault);
}

}  // namespace Stg
