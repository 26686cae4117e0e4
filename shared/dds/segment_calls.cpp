// Fast DDS maps shared memory by these two calls of libc, and never asks whose it is or whether it
// is there. A program that holds these (our services and tools; not the client library, which is a
// guest in its host) has both asked for every segment, port and pool, whoever makes or opens it.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <cerrno>

#include "dds/shared_memory.hpp"

extern "C" {

/// As POSIX has it; EACCES also for what crane::dds::use_segment() refuses.
int shm_open(const char* name, int flags, mode_t mode) {
  static auto* const of_libc =
      reinterpret_cast<int (*)(const char*, int, mode_t)>(dlsym(RTLD_NEXT, "shm_open"));
  const int file = of_libc(name, flags, mode);
  if (file < 0 || crane::dds::use_segment(name, file)) return file;
  close(file);
  errno = EACCES;
  return -1;
}

/// As POSIX has it; in a tmpfs the memory is there when this returns, or it fails with ENOSPC and
/// the file is empty. Without, a full tmpfs ends the process by SIGBUS at some later write.
int ftruncate(int file, off_t size) noexcept {
  constexpr decltype(statfs::f_type) kTmpfs = 0x01021994;
  if (syscall(SYS_ftruncate, file, size) != 0) return -1;
  struct statfs in {};
  if (size == 0 || fstatfs(file, &in) != 0 || in.f_type != kTmpfs) return 0;
  int failed = EINTR;
  while (failed == EINTR) failed = posix_fallocate(file, 0, size);
  if (failed == 0) return 0;
  syscall(SYS_ftruncate, file, off_t{0});
  errno = failed;
  return -1;
}

}  // extern "C"
