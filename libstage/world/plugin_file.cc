// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/plugin_file.hh"

#include <elf.h>
#include <fcntl.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include "world/plugin_stamp.hh"

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

bool ReadSegments(const File& file, const ElfW(Ehdr) & header, std::vector<ElfW(Phdr)>* segments) {
  if (header.e_phentsize != sizeof(ElfW(Phdr))) return false;
  segments->resize(header.e_phnum);
  return file.Read(segments->data(), segments->size() * sizeof(ElfW(Phdr)), header.e_phoff);
}

/// True if all segments that the loader reads lie within the file.
bool IsWhole(const File& file, const ElfW(Ehdr) & header, uint64_t size) {
  std::vector<ElfW(Phdr)> segments;
  if (!ReadSegments(file, header, &segments)) return false;
  for (const ElfW(Phdr) & segment : segments)
    if (segment.p_offset > size || segment.p_filesz > size - segment.p_offset) return false;
  return true;
}

/// Appends the stamps among the ELF notes of a segment.
void AppendStamps(std::string_view notes, std::vector<std::string>* stamps) {
  const auto aligned = [](uint64_t size) { return (size + 3) / 4 * 4; };
  ElfW(Nhdr) head;
  while (notes.size() >= sizeof head) {
    std::memcpy(&head, notes.data(), sizeof head);
    const uint64_t stamp_at = sizeof head + aligned(head.n_namesz);
    const uint64_t end = stamp_at + aligned(head.n_descsz);
    if (head.n_namesz == 0 || end > notes.size()) return;  // padding, or not a note
    const std::string_view stamp = notes.substr(static_cast<size_t>(stamp_at), head.n_descsz);
    if (notes.substr(sizeof head, head.n_namesz) == std::string_view("Stage", 6))
      stamps->emplace_back(stamp.substr(0, stamp.find('\0')));
    notes.remove_prefix(static_cast<size_t>(end));
  }
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

std::string FaultOfStamp(const std::string& path) {
  constexpr size_t kLargest = 1 << 20;  // bytes of notes
  const File file(path);
  ElfW(Ehdr) header;
  std::vector<ElfW(Phdr)> segments;
  if (!file.is_open() || !file.Read(&header, sizeof header, 0) ||
      !ReadSegments(file, header, &segments))
    return "";
  std::vector<std::string> stamps;
  for (const ElfW(Phdr) & segment : segments) {
    if (segment.p_type != PT_NOTE || segment.p_filesz > kLargest) continue;
    std::string notes(segment.p_filesz, '\0');
    if (file.Read(notes.data(), notes.size(), segment.p_offset)) AppendStamps(notes, &stamps);
  }
  constexpr char kAdvice[] = ", expected " STAGE_PLUGIN_STAMP "; build it anew";
  if (stamps.empty())
    return path + " was built for headers of an older version of Stage, without a stamp" + kAdvice;
  for (const std::string& stamp : stamps)
    if (stamp != STAGE_PLUGIN_STAMP)
      return path + " was built for headers of another version of Stage: found " + stamp + kAdvice;
  return "";
}

}  // namespace Stg
