// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/ray_model_reader.hh"

#include <string>

#include "messages/report.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

RayModel ReadRayModel(Worldfile* wf, int entity, RayModel fallback) {
  if (!wf->PropertyExists(entity, "ray_model")) return fallback;
  const std::string name = wf->ReadString(entity, "ray_model", "");
  if (name == "cell") return RayModel::kCell;
  if (name != "exact")
    wf->Fail(entity, "ray_model",
             "found " + messages::Quoted(name) + ", expected \"cell\" or \"exact\"");
  return RayModel::kExact;
}

}  // namespace Stg
