// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/picture_path.hh"

#include <memory>
#include <utility>

#include "geometry/load_error.hh"
#include "models/host.hh"
#include "pictures/picture.hh"
#include "worldfile/find_file.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

std::string PathOfPicture(Worldfile* wf, int entity, const char* property,
                          const std::string& name) {
  const std::string beside = wf->ReadFilename(entity, property, name.c_str());
  std::string found = worldfile::FindFile("", beside);
  if (found.empty()) found = worldfile::FindShipped(name);
  return found.empty() ? beside : found;
}

const std::string* PictureInMemory(const Host& host, const std::string& name) {
  if (!host.pictures) return nullptr;
  const auto found = host.pictures->find(name);
  return found == host.pictures->end() ? nullptr : &found->second;
}

std::string KeyOfPicture(const Host& host, Worldfile* wf, int entity, const char* property,
                         const std::string& name) {
  return PictureInMemory(host, name) ? name : PathOfPicture(wf, entity, property, name);
}

const picture::Samples& SamplesOfPicture(Host* host, Worldfile* wf, int entity,
                                         const char* property, const std::string& name) {
  const std::string* const content = PictureInMemory(*host, name);
  const std::string key = KeyOfPicture(*host, wf, entity, property, name);
  Host::Samples& known = host->samples_of_pictures;
  if (const auto found = known.find(key); found != known.end()) return *found->second;
  try {
    auto samples = std::make_shared<picture::Samples>(
        content ? picture::LoadSamplesFromMemory(content->data(), content->size(), name)
                : picture::LoadSamples(key));
    return *known.emplace(key, std::move(samples)).first->second;
  } catch (const LoadError& error) {
    throw LoadError(wf->Where(entity, property) + ": " + error.what(), error.exit_status());
  }
}

}  // namespace Stg
