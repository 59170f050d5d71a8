// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/paged_array.hh"

#if defined(__linux__)
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace Stg::internal::grid {

#if defined(__linux__)

namespace {

/// Adds spare capacity, so that a copy can grow a little without reallocation.
std::size_t WithSpareCapacity(std::size_t size) {
  constexpr std::size_t kMinSpare = 1 << 16;
  return size + size / 4 + kMinSpare;
}

/// Smaller arrays are cheaper to copy than to share, and shared ones take a file each.
constexpr std::size_t kMinShared = 1 << 15;

/// Leaves half of the numbers of files, often 1024, to the rest of the process.
bool IsAmongTooMany(int file) {
  rlimit most{};
  return getrlimit(RLIMIT_NOFILE, &most) == 0 && static_cast<rlim_t>(file) >= most.rlim_cur / 2;
}

bool WriteAll(int file, const void* bytes, std::size_t size) {
  for (std::size_t done = 0; done < size;) {
    const ssize_t written = write(file, static_cast<const char*>(bytes) + done, size - done);
    if (written <= 0) return false;
    done += static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace

/// Uses an anonymous file in memory, which no other process can see.
std::shared_ptr<const SharedPages> SharedPages::Make(const void* bytes, std::size_t size) {
  const int file = size < kMinShared ? -1 : memfd_create("stage", MFD_CLOEXEC);
  if (file < 0) return nullptr;
  std::shared_ptr<const SharedPages> pages(new SharedPages(file, WithSpareCapacity(size)));
  if (IsAmongTooMany(file) || !WriteAll(file, bytes, size) ||
      ftruncate(file, static_cast<off_t>(pages->size_)) != 0)
    return nullptr;
  return pages;
}

SharedPages::~SharedPages() { close(file_); }

/// A private mapping: the kernel copies a page when it is written to.
void* SharedPages::Map(std::size_t* size) const {
  void* const memory = mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE, file_, 0);
  if (memory == MAP_FAILED) return nullptr;
  *size = size_;
  return memory;
}

void SharedPages::Unmap(void* memory, std::size_t size) { munmap(memory, size); }

#else

std::shared_ptr<const SharedPages> SharedPages::Make(const void*, std::size_t) { return nullptr; }
SharedPages::~SharedPages() = default;
void* SharedPages::Map(std::size_t*) const { return nullptr; }
void SharedPages::Unmap(void*, std::size_t) {}

#endif

}  // namespace Stg::internal::grid
