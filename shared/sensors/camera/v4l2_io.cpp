// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/v4l2_io.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

namespace crane {
namespace {

class Kernel final : public V4l2Io {
 public:
  int open(const std::string& path) override {
    const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return fd < 0 ? -errno : fd;
  }
  void close(int fd) override { ::close(fd); }
  int ioctl(int fd, unsigned long request, void* argument) override {
    for (;;) {
      const int done = ::ioctl(fd, request, argument);
      if (done >= 0) return done;
      if (errno != EINTR) return -errno;
    }
  }
  void* map(int fd, std::size_t length, std::size_t offset) override {
    void* memory =
        mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, static_cast<off_t>(offset));
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void unmap(void* memory, std::size_t length) override { munmap(memory, length); }
  int wait(int fd, int timeout_ms) override {
    pollfd p{fd, POLLIN, 0};
    const int ready = poll(&p, 1, timeout_ms);
    return ready < 0 ? (errno == EINTR ? 0 : -errno) : ready;
  }
};

}  // namespace

std::unique_ptr<V4l2Io> kernel_v4l2() {
  return std::make_unique<Kernel>();
}

}  // namespace crane
