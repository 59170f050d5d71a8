// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/world_files.hh"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>

#include "files/whole_file.hh"
#include "messages/report.hh"
#include "models/host.hh"
#include "models/picture_path.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg::recording {

namespace {

namespace fs = std::filesystem;

/// Returns the absolute path; resolves links and dots in the part that exists.
fs::path PlaceOf(const std::string& name) {
  std::error_code unknown;
  const fs::path place = fs::weakly_canonical(fs::absolute(name, unknown), unknown);
  return unknown ? fs::path("/") / fs::path(name).filename() : place;
}

/// Returns the deepest folder that contains all files.
fs::path CommonFolder(const std::vector<fs::path>& places) {
  fs::path common = places[0].parent_path();
  for (const fs::path& place : places)
    while (std::mismatch(common.begin(), common.end(), place.begin(), place.end()).first !=
           common.end())
      common = common.parent_path();
  return common;
}

bool StaysInside(const fs::path& name) {
  if (name.empty() || name.is_absolute()) return false;
  for (const fs::path& part : name)
    if (part == "..") return false;
  return true;
}

/// Keys of all pictures that the world has read.
std::set<std::string> PicturesOf(const Host& host) {
  std::set<std::string> keys;
  for (const auto& [key, outlines] : host.outlines_of_pictures) keys.insert(key);
  for (const auto& [key, samples] : host.samples_of_pictures) keys.insert(key);
  return keys;
}

}  // namespace

std::vector<WorldFile> FilesOf(World* world) {
  std::vector<WorldFile> files;
  if (!world->GetWorldFile()) return files;
  for (Worldfile::Text& text : world->GetWorldFile()->Texts())
    files.push_back({std::move(text.name), std::move(text.text)});
  const fs::path folder = files.empty() ? fs::path() : fs::path(files[0].name).parent_path();
  for (const std::string& path : PicturesOf(world->host())) {
    if (const std::string* const content = PictureInMemory(world->host(), path)) {
      files.push_back({(folder / path).string(), *content});
      continue;
    }
    std::ifstream in(path, std::ios::binary);
    std::string content(std::istreambuf_iterator<char>(in), {});
    if (in.bad() || content.empty())
      messages::Warn("the log will lack " + messages::Quoted(path) + ", which can't be read");
    else
      files.push_back({path, std::move(content)});
  }
  if (files.empty()) return files;
  std::vector<fs::path> places;
  for (const WorldFile& file : files) places.push_back(PlaceOf(file.name));
  const fs::path common = CommonFolder(places);
  for (size_t i = 0; i < files.size(); i++)
    files[i].name = places[i].lexically_relative(common).string();
  return files;
}

UnpackedFiles::UnpackedFiles(const std::vector<WorldFile>& files) {
  std::error_code error;
  std::string pattern = (fs::temp_directory_path(error) / "stage-replay-XXXXXX").string();
  if (error || !mkdtemp(pattern.data()))
    throw std::runtime_error("no folder for the files of the world: " +
                             std::string(std::strerror(error ? error.value() : errno)));
  folder_ = pattern;
  try {
    Unpack(files);
  } catch (...) {
    fs::remove_all(folder_, error);
    throw;
  }
}

void UnpackedFiles::Unpack(const std::vector<WorldFile>& files) {
  std::set<std::string> folders;
  for (const WorldFile& file : files) {
    if (!StaysInside(file.name))
      throw std::runtime_error("found a file called " + messages::Quoted(file.name) +
                               ", expected a name that leads to no other folder");
    const fs::path place = fs::path(folder_) / file.name;
    std::error_code failed;
    fs::create_directories(place.parent_path(), failed);
    const int error = failed ? failed.value() : files::MakeFile(place.string(), file.content);
    if (error != 0)
      throw std::runtime_error(messages::Quoted(place.string()) +
                               " can't be written: " + std::strerror(error));
    if (world_file_.empty()) world_file_ = place.string();
    folders.insert(place.parent_path().string());
  }
  for (const std::string& folder : folders) folders_ += (folders_.empty() ? "" : ":") + folder;
}

UnpackedFiles::~UnpackedFiles() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace Stg::recording
