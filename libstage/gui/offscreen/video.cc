// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/video.hh"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

extern char** environ;

namespace Stg::offscreen {

namespace {

constexpr const char* kExtensions[] = {".mp4", ".m4v", ".mov", ".mkv", ".webm", ".avi"};

/// Returns the extension with its point, in lower case.
std::string ExtensionOf(const std::string& name) {
  const size_t point = name.rfind('.');
  if (point == std::string::npos || name.find('/', point) != std::string::npos) return "";
  std::string ending = name.substr(point);
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

/// Returns the first ffmpeg in PATH, or an empty string.
std::string FindProgram() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string program = (folder.empty() ? "." : folder) + "/ffmpeg";
    if (access(program.c_str(), X_OK) == 0) return program;
  }
  return "";
}

bool Exists(const std::string& file) {
  struct stat found;
  return lstat(file.c_str(), &found) == 0;
}

std::string CannotBeWritten(const std::string& file, int error) {
  return file + " can't be written: " + std::strerror(error);
}

/// Returns 0 if a file can be made in the folder of `file`, otherwise an errno value. Leaves no
/// trace, even if the program is killed: the file that it makes has no name.
int TryToMakeFile(const std::string& file) {
  const size_t slash = file.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : file.substr(0, slash + 1);
  const int made = open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (made >= 0) {
    close(made);
    return 0;
  }
  if (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL) return errno;
  return access(folder.c_str(), W_OK | X_OK) == 0 ? 0 : errno;  // some file systems can't do it
}

/// Makes a new file beside `file` with its extension. Returns the name, or "" on failure.
std::string MakeTemporaryFile(const std::string& file) {
  const std::string ending = file.substr(file.size() - ExtensionOf(file).size());
  std::string name = file.substr(0, file.size() - ending.size()) + "-XXXXXX" + ending;
  const int made = mkstemps(name.data(), static_cast<int>(ending.size()));
  if (made < 0) return "";
  const mode_t mask = umask(0);
  umask(mask);
  fchmod(made, 0666 & ~mask);
  close(made);
  return name;
}

}  // namespace

bool IsVideoName(const std::string& name) {
  const std::string ending = ExtensionOf(name);
  return std::find(std::begin(kExtensions), std::end(kExtensions), ending) != std::end(kExtensions);
}

bool Video::Open(const std::string& file, std::string* error) {
  file_ = file;
  program_ = FindProgram();
  if (program_.empty()) {
    *error = file +
             " needs the program ffmpeg, which is not on PATH: install the package ffmpeg, or " +
             "give a folder name to get single images";
    return false;
  }
  if (Exists(file)) {
    *error = file + " exists, expected a new name";
    return false;
  }
  const int problem = TryToMakeFile(file);
  if (problem != 0) *error = CannotBeWritten(file, problem);
  return problem == 0;
}

Video::~Video() {
  std::string ignored;
  End(&ignored);
  if (!temporary_name_.empty()) unlink(temporary_name_.c_str());
}

bool Video::Start(const Image& image, double frames_per_second, std::string* error) {
  // Not before the first frame: until the world is loaded, Ctrl-C ends the program at once.
  temporary_name_ = MakeTemporaryFile(file_);
  if (temporary_name_.empty()) {
    *error = CannotBeWritten(file_, errno);
    return false;
  }
  int ends[2];
  error_file_ = memfd_create("ffmpeg", MFD_CLOEXEC);
  // A socket instead of a pipe: writing to a pipe without a reader would raise SIGPIPE.
  if (error_file_ < 0 || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    *error = CannotBeWritten(file_, errno);
    return false;
  }
  frames_ = ends[0];
  char size[48], rate[32];
  std::snprintf(size, sizeof size, "%dx%d", image.width, image.height);
  std::snprintf(rate, sizeof rate, "%.6g", frames_per_second);
  const std::string target = "file:" + temporary_name_;  // not an option or a URL
  // Many players require even sizes and 4:2:0 chroma.
  const std::vector<const char*> words = {
      "ffmpeg",   "-loglevel", "error",        "-y",
      "-f",       "rawvideo",  "-pix_fmt",     "rgba",
      "-s",       size,        "-r",           rate,
      "-i",       "pipe:0",    "-vf",          "pad=ceil(iw/2)*2:ceil(ih/2)*2",
      "-pix_fmt", "yuv420p",   target.c_str(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, error_file_, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP);  // Ctrl-C must not reach ffmpeg
  const int problem = posix_spawn(&process_, program_.c_str(), &files, &attributes,
                                  const_cast<char* const*>(words.data()), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  close(ends[1]);
  if (problem == 0) return true;
  process_ = -1;
  *error = program_ + " can't be started: " + std::strerror(problem);
  return false;
}

bool Video::Write(const Image& image, double frames_per_second, std::string* error) {
  if (process_ < 0 && !Start(image, frames_per_second, error)) return false;
  size_t sent = 0;
  while (sent < image.pixels.size()) {
    const ssize_t part =
        send(frames_, &image.pixels[sent], image.pixels.size() - sent, MSG_NOSIGNAL);
    if (part < 0 && errno == EINTR) continue;
    if (part < 0) {
      if (End(error)) *error = file_ + " can't be written: ffmpeg has ended";
      return false;
    }
    sent += static_cast<size_t>(part);
  }
  return true;
}

/// Waits until ffmpeg has finished the file.
bool Video::End(std::string* error) {
  if (frames_ >= 0) close(frames_);
  frames_ = -1;
  int status = 0;
  bool good = true;
  if (process_ > 0) {
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) continue;
    good = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  process_ = -1;
  if (!good) *error = file_ + " can't be written: ffmpeg: " + LastErrorLine();
  if (error_file_ >= 0) close(error_file_);
  error_file_ = -1;
  return good;
}

std::string Video::LastErrorLine() const {
  std::string text(4096, '\0');
  const off_t length = lseek(error_file_, 0, SEEK_END);
  const off_t start = std::max<off_t>(0, length - static_cast<off_t>(text.size()));
  const ssize_t count = pread(error_file_, text.data(), text.size(), start);
  text.resize(static_cast<size_t>(std::max<ssize_t>(count, 0)));
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  text = text.substr(text.rfind('\n') + 1);
  return text.empty() ? "no reason given" : text;
}

bool Video::Finish(std::string* error) {
  if (!End(error)) return false;
  return temporary_name_.empty() || Publish(error);  // empty: no frame was due
}

/// Renames the file to its final name, unless that name is taken.
bool Video::Publish(std::string* error) {
  if (link(temporary_name_.c_str(), file_.c_str()) != 0) {
    const int problem = errno;
    const bool has_links = problem != EPERM && problem != ENOTSUP && problem != ENOSYS;
    if (has_links || Exists(file_) || rename(temporary_name_.c_str(), file_.c_str()) != 0) {
      *error = CannotBeWritten(file_, has_links ? problem : EEXIST);
      return false;
    }
  } else {
    unlink(temporary_name_.c_str());
  }
  temporary_name_.clear();
  return true;
}

}  // namespace Stg::offscreen
