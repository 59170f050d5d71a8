// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/folder.hh"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "files/whole_file.hh"
#include "stage/parse_number.hh"

namespace Stg::program {

namespace {

constexpr uint64_t kRunsInAFolder = 1000;

[[noreturn]] void Fail(const char* what, const std::string& file, int error) {
  throw std::runtime_error(std::string("can't ") + what + " '" + file +
                           "': " + std::strerror(error));
}

std::string ReadWhole(const std::string& name) {
  std::ifstream in(name, std::ios::binary);
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (!in || !text) Fail("read", name, errno);
  return text.str();
}

std::string FolderOf(const std::string& sweep, uint64_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "/runs/%03" PRIu64, index / kRunsInAFolder);
  return sweep + name;
}

std::string FileOf(const std::string& sweep, uint64_t index, const char* ending) {
  char name[32];
  std::snprintf(name, sizeof name, "/%06" PRIu64, index);
  return FolderOf(sweep, index) + name + ending;
}

void MakeFolder(const std::string& name) {
  std::error_code error;
  std::filesystem::create_directories(name, error);
  if (error) Fail("make", name, error.value());
}

/// Marks those whose records are in that folder and not empty.
void MarkFinished(const std::string& folder, std::vector<bool>* finished) {
  const std::unique_ptr<DIR, int (*)(DIR*)> files(opendir(folder.c_str()), closedir);
  if (!files) {
    if (errno == ENOENT) return;
    Fail("read", folder, errno);
  }
  for (;;) {
    errno = 0;
    const dirent* const file = readdir(files.get());
    if (!file && errno != 0) Fail("read", folder, errno);
    if (!file) return;
    const std::string_view name = file->d_name;
    if (!name.ends_with(".json")) continue;
    const auto index = ParseNumber<size_t>(name.substr(0, name.size() - 5));
    struct stat about = {};
    if (!index || *index >= finished->size()) continue;
    // A crash of the system may leave one that was not written out yet.
    if (fstatat(dirfd(files.get()), file->d_name, &about, 0) == 0 && about.st_size > 0)
      (*finished)[*index] = true;
  }
}

}  // namespace

std::string SweepFolder::RecordFile(uint64_t index) const { return FileOf(path_, index, ".json"); }

std::string SweepFolder::LogFile(uint64_t index) const { return FileOf(path_, index, ".mcap"); }

bool SweepFolder::HasPlan() const { return std::filesystem::exists(PlanFile()); }

Plan SweepFolder::Read() const {
  if (!HasPlan())
    throw std::runtime_error("found no sweep in '" + path_ +
                             "', expected the folder that a sweep's -o has named");
  try {
    return ReadPlan(ReadWhole(PlanFile()));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(PlanFile() + ": " + error.what());
  }
}

void SweepFolder::Write(const Plan& plan) const {
  MakeFolder(path_ + "/runs");
  const std::string text = ToJson(plan);
  const int error = files::MakeFile(PlanFile(), text);
  if (error == EEXIST) {  // another part of the same sweep may have made it
    if (ReadWhole(PlanFile()) == text) return;
    throw std::runtime_error("found another sweep in '" + path_ +
                             "', expected a new folder, or --resume to go on with that one");
  }
  if (error != 0) Fail("write", PlanFile(), error);
}

std::vector<bool> SweepFolder::Finished(const Plan& plan) const {
  std::vector<bool> finished(static_cast<size_t>(plan.Count()));  // kMostRuns at most
  for (uint64_t first = 0; first < finished.size(); first += kRunsInAFolder)
    MarkFinished(FolderOf(path_, first), &finished);
  return finished;
}

std::string SweepFolder::ReadRecord(uint64_t index) const { return ReadWhole(RecordFile(index)); }

void SweepFolder::WriteRecord(uint64_t index, const std::string& record) const {
  const std::string file = RecordFile(index);
  int error = files::ReplaceFile(file, record, files::AnyFile, files::Lasts::kSoon);
  if (error == ENOENT) {
    MakeFolderOf(index);
    error = files::ReplaceFile(file, record, files::AnyFile, files::Lasts::kSoon);
  }
  if (error != 0) Fail("write", file, error);
}

void SweepFolder::MakeFolderOf(uint64_t index) const { MakeFolder(FolderOf(path_, index)); }

void SweepFolder::Sync() const {
  const int folder = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  syncfs(folder);
  close(folder);
}

SweepLock::SweepLock(const SweepFolder& folder, const std::string& part)
    : name_(folder.path() + "/lock." + part) {
  do {  // until the file that is locked is the one of that name: the last owner removes it
    file_ = open(name_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file_ < 0) Fail("write", name_, errno);
    if (flock(file_, LOCK_EX | LOCK_NB) == 0) continue;
    const int error = errno;
    close(file_);
    if (error == EWOULDBLOCK)
      throw std::runtime_error("another stage sweep works on '" + folder.path() +
                               "' now; --status says how far it is");
    Fail("lock", name_, error);
  } while (!IsInPlace());
}

/// Closes the file otherwise.
bool SweepLock::IsInPlace() {
  struct stat held = {}, named = {};
  if (fstat(file_, &held) == 0 && stat(name_.c_str(), &named) == 0 && held.st_ino == named.st_ino)
    return true;
  close(file_);
  return false;
}

SweepLock::~SweepLock() {
  unlink(name_.c_str());
  close(file_);
}

}  // namespace Stg::program
