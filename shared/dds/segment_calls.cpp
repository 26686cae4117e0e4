// SPDX-License-Identifier: Apache-2.0
// Fast DDS maps shared memory by these two calls of libc, and never asks whose
// it is or whether it is there. A program that holds these (our services and
// tools; not the client library, which is a guest in its host) has both asked
// for every segment, port and pool, whoever makes or opens it.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string_view>

#include "dds/shared_memory.hpp"

namespace {

/// Whether Fast DDS calls a segment for messages so: "fastrtps_" and 16
/// hexadecimal digits.
bool is_of_messages(std::string_view name) {
  if (name.starts_with('/')) name.remove_prefix(1);
  constexpr std::string_view kPrefix = "fastrtps_";
  return name.starts_with(kPrefix) && name.size() == kPrefix.size() + 16 &&
         name.find_first_not_of("0123456789abcdef", kPrefix.size()) == std::string_view::npos;
}

/// A segment without messages: wherever a descriptor points in it lies one of
/// no bytes, which the guard refuses. It takes no memory but the pages that are
/// written. -1 where there is none.
int empty_segment() {
  static const int file = [] {
    // Offsets and sizes of Fast DDS's segments have 32 bits: one byte more and
    // it takes a null for the head of the segment.
    constexpr off_t kSize = (off_t{1} << 32U) - 4096;
    constexpr std::uint32_t kInitialized = 2;  // boost::interprocess: may be opened
    const int made = memfd_create("cranemap_empty_segment", MFD_CLOEXEC);
    if (made >= 0 && syscall(SYS_ftruncate, made, kSize) == 0 &&
        pwrite(made, &kInitialized, sizeof kInitialized, 0) == sizeof kInitialized)
      return made;
    return -1;
  }();
  return file < 0 ? -1 : fcntl(file, F_DUPFD_CLOEXEC, 0);
}

}  // namespace

extern "C" {

/// As POSIX has it; EACCES also for what crane::dds::use_segment() refuses. A
/// segment for messages that is not there (any more) is an empty one: who sent
/// from it has ended, or was killed and cleared, before its first message was
/// taken. Fast DDS would ask for it again and again, and take nothing else from
/// that port, for ever.
int shm_open(const char* name, int flags, mode_t mode) {
  static auto* const of_libc =
      reinterpret_cast<int (*)(const char*, int, mode_t)>(dlsym(RTLD_NEXT, "shm_open"));
  const int file = of_libc(name, flags, mode);
  if (file >= 0 && crane::dds::use_segment(name, file)) return file;
  const int why = file < 0 ? errno : EACCES;
  if (file >= 0) close(file);
  if ((flags & O_CREAT) == 0 && is_of_messages(name))
    if (const int empty = empty_segment(); empty >= 0) return empty;
  errno = why;
  return -1;
}

/// As POSIX has it; in a tmpfs the memory is there when this returns, or it
/// fails with ENOSPC and the file is as it was: it never shrinks under somebody
/// who has it mapped. Without, a full tmpfs ends the process by SIGBUS at some
/// later write.
int ftruncate(int file, off_t size) noexcept {
  constexpr decltype(statfs::f_type) kTmpfs = 0x01021994;
  struct statfs in {};
  if (size > 0 && fstatfs(file, &in) == 0 && in.f_type == kTmpfs) {
    int failed = EINTR;
    while (failed == EINTR) failed = posix_fallocate(file, 0, size);
    if (failed != 0) {
      errno = failed;
      return -1;
    }
  }
  return static_cast<int>(syscall(SYS_ftruncate, file, size));
}

}  // extern "C"
