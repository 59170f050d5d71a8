// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/pocl_cache.hh"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <system_error>

#include "libstage_cl/environment.hh"

namespace Stg::cl {

namespace {

namespace fs = std::filesystem;

/// PoCL's cache folder, by its own rules; empty if it would be in /tmp.
std::string CacheFolder() {
  if (std::string own = FromEnvironment("POCL_CACHE_DIR"); !own.empty()) return own;
  if (const std::string cache = FromEnvironment("XDG_CACHE_HOME"); !cache.empty())
    return cache + "/pocl/kcache";
  if (const std::string home = FromEnvironment("HOME"); !home.empty())
    return home + "/.cache/pocl/kcache";
  return "";
}

/// True if only this user can write to the folder.
bool IsOurs(const std::string& folder) {
  struct stat status = {};
  return lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) &&
         status.st_uid == geteuid() && (status.st_mode & 022) == 0;
}

/// A folder that lasts until the user logs out, or empty.
std::string FolderOfSession() {
  const std::string session = FromEnvironment("XDG_RUNTIME_DIR");
  if (session.empty() || !IsOurs(session)) return "";
  const std::string folder = session + "/stage-pocl";
  mkdir(folder.c_str(), 0700);
  return IsOurs(folder) ? folder : "";
}

/// A folder for this process, which removes it at its end, or empty.
std::string FolderOfProcess() {
  static std::string folder;
  const std::string temporary = FromEnvironment("TMPDIR");
  folder = (temporary.empty() ? "/tmp" : temporary) + "/stage-pocl-XXXXXX";
  if (!mkdtemp(folder.data())) return "";
  static const pid_t owner = getpid();
  std::atexit([] {
    std::error_code ignored;
    if (getpid() == owner) fs::remove_all(folder, ignored);
  });
  return folder;
}

/// Tries to write about as much as kernels need. Returns the error, or an empty string.
std::string WhyNotWritable(const std::string& folder) {
  constexpr off_t kRoom = 1 << 20;
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return error.message();
  std::string file = folder + "/stage-XXXXXX";
  const int descriptor = mkstemp(file.data());
  if (descriptor < 0) return std::generic_category().message(errno);
  const int full = posix_fallocate(descriptor, 0, kRoom);
  close(descriptor);
  unlink(file.c_str());
  return full == 0 ? "" : std::generic_category().message(full);
}

}  // namespace

void KeepPoclCachePrivate() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (!CacheFolder().empty()) return;
    std::string folder = FolderOfSession();
    if (folder.empty()) folder = FolderOfProcess();
    if (!folder.empty()) setenv("POCL_CACHE_DIR", folder.c_str(), 1);
  });
}

std::string WhyPoclCantWrite(const std::string& driver) {
  if (driver.find("Portable Computing Language") == std::string::npos) return "";
  const std::string folder = CacheFolder(), why = WhyNotWritable(folder);
  if (why.empty()) return "";
  return "; it can't write to its cache, " + folder + " (" + why +
         "): set POCL_CACHE_DIR to a folder where it can";
}

std::string WhyPoclCrashes(const std::string& driver) {
  if (driver.find("Portable Computing Language") == std::string::npos) return "";
  const std::string why = WhyPoclCantWrite(driver);
  return why.empty() ? "; if its cache is damaged, remove " + CacheFolder() : why;
}

}  // namespace Stg::cl
