// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/folder.hh"

#include <dirent.h>
#include <fcntl.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "files/whole_file.hh"
#include "stage/option_values.hh"
#include "stage/parse_number.hh"
#include "stage/sweep/json_text.hh"
#include "stage/sweep/record.hh"

namespace Stg::program {

namespace {

constexpr uint64_t kRunsPerFolder = 1000;

[[noreturn]] void Fail(const char* what, const std::string& file, int error) {
  throw std::runtime_error(std::string("can't ") + what + " '" + file +
                           "': " + std::strerror(error));
}

/// Reads a file. Special files are refused, since a pipe might never end.
std::string ReadWhole(const std::string& name) {
  constexpr uintmax_t kMaxBytes =
      1 << 28;  // bytes; plans have a few megabytes at most, records a few kB
  std::error_code failed;
  const auto status = std::filesystem::status(name, failed);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    Fail("read", name, std::filesystem::is_directory(status) ? EISDIR : EINVAL);
  const uintmax_t size = std::filesystem::file_size(name, failed);
  if (!failed && size > kMaxBytes) Fail("read", name, EFBIG);
  std::ifstream in(name, std::ios::binary);
  std::ostringstream text;
  if (in && size > 0) text << in.rdbuf();
  if (!in || !text) Fail("read", name, errno);
  return text.str();
}

/// True if a sweep may have created the file before or beside its plan.
bool BelongsToSweep(const std::filesystem::path& file) {
  const std::string name = file.filename().string();
  for (const char* beginning : {"lock.", ".stage-", ".plan-"})
    if (name.starts_with(beginning)) return true;
  std::error_code failed;
  return name == "sweep.json" || (name == "runs" && std::filesystem::is_empty(file, failed));
}

bool IsHome(const std::filesystem::path& folder) {
  std::error_code failed;
  const passwd* const user = getpwuid(getuid());
  for (const char* home : {static_cast<const char*>(std::getenv("HOME")),
                           user ? static_cast<const char*>(user->pw_dir) : nullptr})
    if (home && *home && std::filesystem::equivalent(folder, home, failed)) return true;
  return false;
}

std::string FolderOf(const std::string& sweep, uint64_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "/runs/%03" PRIu64, index / kRunsPerFolder);
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

/// Marks runs that have a non-empty record in this folder.
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
    // After a system crash, a record that was not synced may be empty.
    if (fstatat(dirfd(files.get()), file->d_name, &about, 0) == 0 && S_ISREG(about.st_mode) &&
        about.st_size > 0)
      (*finished)[*index] = true;
  }
}

}  // namespace

std::string SweepFolder::RecordFile(uint64_t index) const { return FileOf(path_, index, ".json"); }

std::string SweepFolder::StartLog(uint64_t index) const {
  MakeFolder(FolderOf(path_, index));
  return FileOf(path_, index, ".mcap.part");
}

void SweepFolder::KeepLog(uint64_t index) const {
  std::filesystem::rename(FileOf(path_, index, ".mcap.part"), FileOf(path_, index, ".mcap"));
}

bool SweepFolder::HasPlan() const { return std::filesystem::exists(PlanFile()); }

Plan SweepFolder::Read() const {
  if (!HasPlan())
    throw std::runtime_error("found no sweep in '" + path_ +
                             "', expected a folder created by stage sweep -o");
  try {
    return ReadPlan(ReadWhole(PlanFile()));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(PlanFile() + ": " + error.what());
  }
}

bool SweepFolder::Make() const {
  namespace fs = std::filesystem;
  const auto refuse = [this](const std::string& found) {
    throw UsageError("-o: found '" + path_ + "', " + found +
                     ", expected the name of a new folder, or of one that is empty");
  };
  std::error_code failed;
  const fs::file_status status = fs::status(path_, failed);
  if (!fs::exists(status)) {
    if (fs::is_symlink(fs::symlink_status(path_, failed)))
      refuse("a symbolic link that leads nowhere");
    MakeFolder(path_);
    return true;
  }
  if (!fs::is_directory(status)) refuse("which is not a folder");
  if (fs::equivalent(path_, "/", failed)) refuse("the root folder");
  if (IsHome(path_)) refuse("a home folder");
  if (HasPlan()) return false;
  fs::directory_iterator entry(path_, failed);
  if (failed) Fail("read", path_, failed.value());
  for (; !failed && entry != fs::directory_iterator(); entry.increment(failed))
    if (!BelongsToSweep(entry->path())) refuse("which is not a sweep folder");
  return false;
}

void SweepFolder::Write(const Plan& plan) const {
  MakeFolder(path_ + "/runs");
  const std::string text = ToJson(plan);
  const int error = files::MakeFile(PlanFile(), text);
  if (error == EEXIST) {  // another part of the same sweep may have written it
    if (ReadWhole(PlanFile()) == text) return;
    throw std::runtime_error("found another sweep in '" + path_ +
                             "', expected a new folder, or --resume to go on with that one");
  }
  if (error != 0) Fail("write", PlanFile(), error);
}

std::vector<bool> SweepFolder::Finished(const Plan& plan) const {
  std::vector<bool> finished(static_cast<size_t>(plan.Count()));  // kMaxRuns at most
  for (uint64_t first = 0; first < finished.size(); first += kRunsPerFolder)
    MarkFinished(FolderOf(path_, first), &finished);
  return finished;
}

bool SweepFolder::HasRecord(uint64_t index) const {
  std::error_code missing;
  return std::filesystem::file_size(RecordFile(index), missing) > 0 && !missing;
}

std::string SweepFolder::ReadRecord(uint64_t index) const { return ReadWhole(RecordFile(index)); }

nlohmann::ordered_json SweepFolder::Record(const Plan& plan, uint64_t index) const {
  const std::string text = ReadRecord(index);
  std::string problem;
  try {
    nlohmann::ordered_json record = ParseJsonText(text);
    CheckRecord(record, plan, index);
    return record;
  } catch (const nlohmann::json::exception&) {
    problem = "found no record of a run";
  } catch (const std::runtime_error& error) {
    problem = error.what();
  }
  throw std::runtime_error(RecordFile(index) + ": " + problem + ", expected the record of run " +
                           std::to_string(index) + "; remove it, and stage sweep --resume " +
                           path_ + " does the run again");
}

void SweepFolder::WriteRecord(uint64_t index, const std::string& record) const {
  const std::string file = RecordFile(index);
  int error = files::ReplaceFile(file, record, files::AnyFile, files::Durability::kBuffered);
  if (error == ENOENT) {
    MakeFolder(FolderOf(path_, index));
    error = files::ReplaceFile(file, record, files::AnyFile, files::Durability::kBuffered);
  }
  if (error != 0) Fail("write", file, error);
}

void SweepFolder::Sync() const {
  const int folder = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
#ifdef __linux__
  syncfs(folder);
#else
  sync();
#endif
  close(folder);
}

SweepLock::SweepLock(const SweepFolder& folder, const std::string& part)
    : name_(folder.path() + "/lock." + part) {
  do {  // repeats until the locked file still has its name, because the last owner removes it
    file_ = open(name_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666);
    if (file_ < 0) Fail("write", name_, errno);
    if (flock(file_, LOCK_EX | LOCK_NB) == 0) continue;
    const int error = errno;
    close(file_);
    if (error == EWOULDBLOCK)
      throw std::runtime_error("another stage sweep works on '" + folder.path() +
                               "' now; --status shows its progress");
    Fail("lock", name_, error);
  } while (!IsInPlace());
}

/// True if the locked file still has its name. Closes it otherwise.
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
