// SPDX-License-Identifier: GPL-2.0-or-later

#include "files/whole_file.hh"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

namespace Stg::files {

namespace {

constexpr mode_t kAllModes = 07777, kNewFile = 0666;

struct Target {
  std::string path;
  bool exists = false;
  bool regular = true;
  mode_t mode = kNewFile;
};

/// True if the name refers to an open file, such as /dev/stdout or /dev/fd/5. Such a file is
/// written to, not replaced, even if it is a regular file.
bool IsOpenFile(std::string_view name) {
  return name.starts_with("/dev/fd/") || name.starts_with("/dev/std") || name.starts_with("/proc/");
}

int WriteAll(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t count = write(file, content.data(), content.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    content.remove_prefix(static_cast<size_t>(count));
  }
  return 0;
}

int CheckContent(int file, IsOurs ours) {
  char beginning[256];
  const ssize_t count = pread(file, beginning, sizeof beginning, 0);
  if (count <= 0) return count < 0 ? errno : 0;
  return ours({beginning, static_cast<size_t>(count)}) ? 0 : EEXIST;
}

int CheckContent(const std::string& path, IsOurs ours) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return errno;
  const int error = CheckContent(file, ours);
  close(file);
  return error;
}

/// Finds out whether the target exists and whether it may be replaced or written to.
int Inspect(const std::string& name, IsOurs ours, Target* target) {
  target->path = AbsolutePath(name);
  struct stat found = {};
  if (stat(target->path.c_str(), &found) != 0) {
    // The file does not exist, or its name is a dangling link, which is replaced as well.
    return errno == ENOENT ? 0 : errno;
  }
  if (S_ISDIR(found.st_mode)) return EISDIR;
  target->exists = true;
  target->regular = S_ISREG(found.st_mode) && !IsOpenFile(name);
  target->mode = found.st_mode & kAllModes;
  if (access(target->path.c_str(), W_OK) != 0) return errno;
  return target->regular && ours != AnyFile ? CheckContent(target->path, ours) : 0;
}

/// Renames a file, but does not replace an existing one. Returns -1 and sets errno on failure.
int RenameWithoutReplacing(const char* from, const char* to) {
#ifdef RENAME_NOREPLACE
  const int result = renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE);
  if (result == 0 || (errno != EINVAL && errno != ENOSYS)) return result;
#endif
  // Some file systems and C libraries do not support RENAME_NOREPLACE.
  return link(from, to) == 0 ? unlink(from) : -1;
}

/// The temporary file beside the target, which is renamed to it when complete.
class Draft {
 public:
  explicit Draft(const Target& target) : target_(target) {
    const std::filesystem::path folder = std::filesystem::path(target.path).parent_path();
    do {
      uint64_t number = 0;
      if (getentropy(&number, sizeof number) != 0) break;
      char name[32];
      std::snprintf(name, sizeof name, ".stage-%016" PRIx64, number);
      path_ = (folder / name).string();
      // The draft is never accessible to more users than the file that it replaces.
      file_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                   target.mode & kNewFile);
    } while (file_ < 0 && errno == EEXIST);
    error_ = file_ < 0 ? errno : 0;
  }
  ~Draft() {
    if (file_ < 0) return;
    close(file_);
    unlink(path_.c_str());
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  int error() const { return error_; }

  /// If `lasting`, the content is synced to disk before the file is renamed.
  void Write(std::string_view content, bool lasting) {
    if (error_ == 0) error_ = WriteAll(file_, content);
    if (error_ != 0) return;
    const bool kept = !target_.exists || fchmod(file_, target_.mode) == 0;
    const bool synced = !lasting || fsync(file_) == 0 || errno == EINVAL || errno == EROFS;
    if (!kept || !synced) error_ = errno;
  }

  int Replace() {
    return CloseAndRename([this] { return std::rename(path_.c_str(), target_.path.c_str()); });
  }

  /// Renames the draft and returns its open descriptor, or a negative error number.
  int ReplaceAndKeep() {
    if (error_ == 0 && std::rename(path_.c_str(), target_.path.c_str()) != 0) error_ = errno;
    return error_ != 0 ? -error_ : std::exchange(file_, -1);
  }

  /// Renames the draft only if the target does not exist.
  int Place() {
    return CloseAndRename(
        [this] { return RenameWithoutReplacing(path_.c_str(), target_.path.c_str()); });
  }

 private:
  template <typename Rename>
  int CloseAndRename(Rename rename) {
    if (error_ != 0) return error_;
    if (close(file_) != 0 || rename() != 0) {
      error_ = errno;
      unlink(path_.c_str());
    }
    file_ = -1;
    return error_;
  }

  const Target& target_;
  std::string path_;
  int file_ = -1;
  int error_ = 0;
};

int WriteToDevice(const std::string& path, std::string_view content) {
  const int file = open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOCTTY);
  if (file < 0) return errno;
  const int error = WriteAll(file, content);
  return close(file) != 0 && error == 0 ? errno : error;
}

/// Opens an existing file for OpenToGrow(). The name may refer to another file since Inspect(), so
/// the content of the opened file is checked again.
int OpenExisting(const Target& target, IsOurs ours) {
  // Names such as /dev/fd/5 are always links.
  const int links = target.regular ? O_NOFOLLOW : 0;
  const int access = target.regular ? O_RDWR : O_WRONLY;
  const int file = open(target.path.c_str(), access | O_CLOEXEC | O_NOCTTY | links);
  if (file < 0) return -errno;
  int error = target.regular ? CheckContent(file, ours) : 0;
  if (error == 0 && target.regular && ftruncate(file, 0) != 0) error = errno;
  if (error == 0) return file;
  close(file);
  return -error;
}

}  // namespace

bool AnyFile(std::string_view) { return true; }

int ReplaceFile(const std::string& name, std::string_view content, IsOurs ours,
                Durability durability) {
  Target target;
  if (const int error = Inspect(name, ours, &target); error != 0) return error;
  if (!target.regular) return WriteToDevice(target.path, content);
  Draft draft(target);
  draft.Write(content, durability == Durability::kSynced);
  return draft.Replace();
}

int TryReplaceFile(const std::string& name, IsOurs ours) {
  Target target;
  const int error = Inspect(name, ours, &target);
  // Creating a draft is the most reliable way to learn whether a file can be created.
  return error != 0 || !target.regular ? error : Draft(target).error();
}

int OpenToGrow(const std::string& name, IsOurs ours) {
  Target target;
  if (const int error = Inspect(name, ours, &target); error != 0) return -error;
  return target.exists ? OpenExisting(target, ours) : Draft(target).ReplaceAndKeep();
}

int MakeFile(const std::string& name, std::string_view content) {
  Target target;
  target.path = name;
  Draft draft(target);
  draft.Write(content, false);
  return draft.Place();
}

std::string AbsolutePath(const std::string& name) {
  if (IsOpenFile(name)) return name;
  std::error_code error;
  std::filesystem::path place = std::filesystem::canonical(name, error);
  if (error) place = std::filesystem::absolute(name, error);
  return error ? name : place.string();
}

}  // namespace Stg::files
