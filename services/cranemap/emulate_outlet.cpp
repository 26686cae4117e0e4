// SPDX-License-Identifier: Apache-2.0
#include "emulate_outlet.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace crane {

namespace fs = std::filesystem;

Result<void> Outlet::plug() {
  if (plugged()) return {};
  if (port_.starts_with("udp://") || port_.starts_with("tcp://")) return plug_socket();
  fd_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0 || grantpt(fd_) != 0 || unlockpt(fd_) != 0) return refuse("no pseudo-terminal");
  std::array<char, 128> name{};
  if (ptsname_r(fd_, name.data(), name.size()) != 0) return refuse("no pseudo-terminal");
  // Raw from the start: nothing is echoed before the other side has opened it.
  if (const int other = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC); other >= 0) {
    termios raw{};
    tcgetattr(other, &raw);
    cfmakeraw(&raw);
    tcsetattr(other, TCSANOW, &raw);
    close(other);
  }
  std::error_code ignored;
  if (fs::is_symlink(port_, ignored)) fs::remove(port_, ignored);
  std::error_code failed;
  fs::create_symlink(name.data(), port_, failed);
  if (failed) return refuse(failed.message());
  linked_ = true;
  return {};
}

void Outlet::unplug() {
  for (int* fd : {&fd_, &listener_}) {
    if (*fd >= 0) close(*fd);
    *fd = -1;
  }
  std::error_code ignored;
  if (linked_) fs::remove(port_, ignored);
  linked_ = false;
}

std::string Outlet::read() {
  accept_one();
  std::array<char, 256> bytes{};
  if (fd_ < 0) return {};
  const ssize_t n = ::read(fd_, bytes.data(), bytes.size());
  if (n == 0 && listener_ >= 0) drop();
  return n > 0 ? std::string(bytes.data(), std::size_t(n)) : "";
}

void Outlet::write(const std::string& bytes) {
  if (fd_ < 0 || bytes.empty()) return;
  const bool socket = listener_ >= 0 || port_.starts_with("udp://");
  const ssize_t n = socket ? send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL)
                           : ::write(fd_, bytes.data(), bytes.size());
  if (n < 0 && (errno == EPIPE || errno == ECONNRESET) && listener_ >= 0) drop();
}

Result<void> Outlet::refuse(const std::string& why) {
  unplug();
  return Error{ErrorCode::kResource, port_, "cannot be emulated: " + why, "choose another --port"};
}

Result<void> Outlet::plug_socket() {
  const bool udp = port_.starts_with("udp://");
  const auto colon = port_.rfind(':');
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(std::atoi(port_.c_str() + colon + 1)));
  if (inet_pton(AF_INET, port_.substr(6, colon - 6).c_str(), &at.sin_addr) != 1)
    return refuse("its host must be an IPv4 address");
  const int fd =
      socket(AF_INET, (udp ? SOCK_DGRAM : SOCK_STREAM) | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  (udp ? fd_ : listener_) = fd;
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const auto* address = reinterpret_cast<const sockaddr*>(&at);
  if (udp ? connect(fd, address, sizeof at) != 0
          : bind(fd, address, sizeof at) != 0 || listen(fd, 1) != 0)
    return refuse(std::strerror(errno));
  return {};
}

void Outlet::accept_one() {
  if (listener_ < 0 || fd_ >= 0) return;
  fd_ = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
}

void Outlet::drop() {
  close(fd_);
  fd_ = -1;
}

}  // namespace crane
