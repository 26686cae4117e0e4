// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace crane {

/// The system calls a V4L2 camera is used by, so that a fake can answer as real drivers do.
/// Each returns as the call does, or -errno.
class V4l2Io {
 public:
  V4l2Io() = default;
  V4l2Io(const V4l2Io&) = delete;
  V4l2Io& operator=(const V4l2Io&) = delete;
  virtual ~V4l2Io() = default;
  virtual int open(const std::string& path) = 0;
  virtual void close(int fd) = 0;
  virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
  /// nullptr when it cannot be had.
  virtual void* map(int fd, std::size_t length, std::size_t offset) = 0;
  virtual void unmap(void* memory, std::size_t length) = 0;
  /// 1: a frame is there, or an error to be told by the next call; 0: none within the time.
  virtual int wait(int fd, int timeout_ms) = 0;
};

/// The kernel's.
std::unique_ptr<V4l2Io> kernel_v4l2();

}  // namespace crane
