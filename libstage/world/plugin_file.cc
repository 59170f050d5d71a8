// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/plugin_file.hh"

#include <elf.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

namespace Stg {

namespace {

class File {
 public:
  /// Opens without blocking if the path is a pipe.
  explicit File(const std::string& path)
      : descriptor_(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)) {}
  ~File() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  struct stat Status() const {
    struct stat status = {};
    fstat(descriptor_, &status);
    return status;
  }
  bool Read(void* to, size_t size, uint64_t from) const {
    return pread(descriptor_, to, size, static_cast<off_t>(from)) == static_cast<ssize_t>(size);
  }

 private:
  int descriptor_;
};

std::string KindOf(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

bool IsForThisProcess(const ElfW(Ehdr) & header, const ElfW(Ehdr) & own) {
  return header.e_ident[EI_CLASS] == own.e_ident[EI_CLASS] &&
         header.e_ident[EI_DATA] == own.e_ident[EI_DATA] && header.e_machine == own.e_machine;
}

/// True if all segments that the loader reads lie within the file.
bool IsWhole(const File& file, const ElfW(Ehdr) & header, uint64_t size) {
  if (header.e_phentsize != sizeof(ElfW(Phdr))) return false;
  std::vector<ElfW(Phdr)> segments(header.e_phnum);
  const size_t bytes = segments.size() * sizeof(ElfW(Phdr));
  if (!file.Read(segments.data(), bytes, header.e_phoff)) return false;
  for (const ElfW(Phdr) & segment : segments)
    if (segment.p_offset > size || segment.p_filesz > size - segment.p_offset) return false;
  return true;
}

}  // namespace

std::string FaultOfPlugin(const std::string& path, const void* own_header) {
  const File file(path);
  if (!file.is_open()) return path + ": " + std::strerror(errno);
  const struct stat status = file.Status();
  if (!S_ISREG(status.st_mode))
    return "found " + KindOf(status.st_mode) + " called " + path + ", expected a file";
  ElfW(Ehdr) header;
  if (!file.Read(&header, sizeof header, 0) || std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 ||
      header.e_type != ET_DYN)
    return path + " is not a shared library (an ELF file)";
  if (own_header && !IsForThisProcess(header, *static_cast<const ElfW(Ehdr)*>(own_header)))
    return path + " is a shared library for other processors";
  if (!IsWhole(file, header, static_cast<uint64_t>(status.st_size)))
    return path + " has been cut short";
  return "";
}

}  // namespace Stg
