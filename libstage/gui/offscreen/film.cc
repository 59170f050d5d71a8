// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/film.hh"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "gui/offscreen/video.hh"

namespace Stg::offscreen {

namespace {

std::string FrameName(const std::string& folder, unsigned number) {
  char name[32];
  std::snprintf(name, sizeof name, "/stage-%06u.png", number);
  return folder + name;
}

/// Returns the name of an existing frame in the folder, or an empty string.
std::string FindFrame(const std::string& folder) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename();
    const bool frame = name.starts_with("stage-") && name.ends_with(".png") &&
                       name.find_first_not_of("0123456789", 6) == name.size() - 4;
    if (frame) return entry.path();
  }
  return "";
}

}  // namespace

std::unique_ptr<Film> Film::Open(const std::string& name, std::string* error) {
  if (IsVideoName(name)) {
    auto video = std::make_unique<Video>();
    return video->Open(name, error) ? std::move(video) : nullptr;
  }
  auto folder = std::make_unique<FrameFolder>();
  return folder->Open(name, error) ? std::move(folder) : nullptr;
}

bool Film::Add(const Image& image, usec_t now, usec_t step, std::string* error) {
  constexpr usec_t kPeriod = 1000000 / kMaxFrameRate;
  const double rate = 1e6 / static_cast<double>(std::max(step, kPeriod));
  if (!Write(image, rate, error)) return false;
  // Frames are due at multiples of the period, which keeps the mean rate exact for any step length.
  next_ = (now / kPeriod + 1) * kPeriod;
  return true;
}

bool FrameFolder::Open(const std::string& folder, std::string* error) {
  struct stat found;
  if (stat(folder.c_str(), &found) != 0) {
    if (mkdir(folder.c_str(), 0777) != 0) {
      *error = folder + " can't be made: " + std::strerror(errno);
      return false;
    }
  } else if (!S_ISDIR(found.st_mode)) {
    *error = folder + " is not a folder, expected one, a new name, or a video's, such as film.mp4";
    return false;
  } else if (access(folder.c_str(), W_OK | X_OK) != 0) {
    *error = folder + " can't be written: " + std::strerror(errno);
    return false;
  } else if (const std::string frame = FindFrame(folder); !frame.empty()) {
    *error = frame + " exists, expected a folder without a film";
    return false;
  }
  folder_ = folder;
  return true;
}

bool FrameFolder::Write(const Image& image, double, std::string* error) {
  const std::string file = FrameName(folder_, frames_);
  if (const int problem = WritePng(file, image, IfExists::kKeep); problem != 0) {
    *error = PngProblem(file, problem);
    return false;
  }
  frames_++;
  return true;
}

}  // namespace Stg::offscreen
