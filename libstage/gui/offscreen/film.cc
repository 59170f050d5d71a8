// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/film.hh"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

namespace Stg::offscreen {

namespace {

std::string FrameName(const std::string& folder, unsigned number) {
  char name[32];
  std::snprintf(name, sizeof name, "/stage-%06u.png", number);
  return folder + name;
}

}  // namespace

bool Film::Open(const std::string& folder, std::string* error) {
  struct stat found;
  if (stat(folder.c_str(), &found) != 0) {
    if (mkdir(folder.c_str(), 0777) != 0) {
      *error = folder + " can't be made: " + std::strerror(errno);
      return false;
    }
  } else if (!S_ISDIR(found.st_mode)) {
    *error = folder + " is no folder, expected one or a new name";
    return false;
  } else if (access(folder.c_str(), W_OK | X_OK) != 0) {
    *error = folder + " can't be written: " + std::strerror(errno);
    return false;
  } else if (access(FrameName(folder, 0).c_str(), F_OK) == 0) {
    *error = FrameName(folder, 0) + " exists, expected a folder without a film";
    return false;
  }
  folder_ = folder;
  return true;
}

bool Film::IsDue(usec_t now) const { return now >= next_; }

bool Film::Add(const Image& image, usec_t now, std::string* error) {
  constexpr usec_t kPeriod = 1000000 / kMostFrames;
  if (!WritePng(FrameName(folder_, frames_), image, error)) return false;
  frames_++;
  // By the grid of periods, so that the mean rate is right whatever the length of the steps.
  next_ = (now / kPeriod + 1) * kPeriod;
  return true;
}

}  // namespace Stg::offscreen
