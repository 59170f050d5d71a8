// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/picture_path.hh"

#include "models/host.hh"
#include "worldfile/find_file.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

std::string PathOfPicture(Worldfile* wf, int entity, const std::string& name) {
  const std::string beside = wf->ReadFilename(entity, "bitmap", name.c_str());
  std::string found = worldfile::FindFile("", beside);
  if (found.empty()) found = worldfile::FindShipped(name);
  return found.empty() ? beside : found;
}

const std::string* PictureInMemory(const Host& host, const std::string& name) {
  if (!host.pictures) return nullptr;
  const auto found = host.pictures->find(name);
  return found == host.pictures->end() ? nullptr : &found->second;
}

std::string KeyOfPicture(const Host& host, Worldfile* wf, int entity, const std::string& name) {
  return PictureInMemory(host, name) ? name : PathOfPicture(wf, entity, name);
}

}  // namespace Stg
