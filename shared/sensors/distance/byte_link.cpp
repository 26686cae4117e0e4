// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/byte_link.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <memory>
#include <utility>

namespace crane {
namespace {

constexpr int kConnectMs = 2000, kWriteMs = 200;
constexpr int kBitsOfCharacter = 10;

Error resource(const std::string& port, const std::string& what, const std::string& todo) {
  return {ErrorCode::kResource, port, what, todo};
}

Error of_errno(const std::string& port, int number) {
  switch (number) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return resource(port, "no such device",
                      "is it plugged in? /dev/serial/by-id has names that stay the same");
    case EACCES:
    case EPERM:
      return resource(port, "no permission",
                      "put the user of this service into group dialout, or give the systemd unit "
                      "SupplementaryGroups=dialout");
    case EBUSY:
    case EWOULDBLOCK:
      return resource(port, "in use by another program", "end it, or is a device listed twice?");
    case ECONNREFUSED:
      return resource(port, "connection refused", "is the device's server switched on?");
    case EADDRINUSE:
      return resource(port, "another program receives on this port", "end it, or use another port");
    case ETIMEDOUT:
    case EHOSTUNREACH:
    case ENETUNREACH:
      return resource(port, "not reachable", "check cable, address and firewall");
    default:
      return resource(port, std::strerror(number), "");
  }
}

const std::map<int, speed_t>& speeds() {
  static const std::map<int, speed_t> kSpeeds = {
      {1200, B1200},      {2400, B2400},      {4800, B4800},     {9600, B9600},
      {19'200, B19200},   {38'400, B38400},   {57'600, B57600},  {115'200, B115200},
      {230'400, B230400}, {460'800, B460800}, {921'600, B921600}};
  return kSpeeds;
}

/// Closes unless released.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

struct HostPort {
  std::string host, port;
};

/// Of "scheme://host:port".
Result<HostPort> split(const std::string& url) {
  const std::string rest = url.substr(6);
  const auto colon = rest.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == rest.size())
    return Error{ErrorCode::kConfiguration, url, "has no port",
                 "write " + url.substr(0, 6) + "host:port"};
  return HostPort{rest.substr(0, colon), rest.substr(colon + 1)};
}

Result<sockaddr_in> address_of(const std::string& url, int type) {
  const auto parts = split(url);
  if (!parts) return parts.error();
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = type;
  addrinfo* found = nullptr;
  if (const int failed = getaddrinfo(parts->host.c_str(), parts->port.c_str(), &hints, &found);
      failed != 0)
    return resource(url, std::string("no such address: ") + gai_strerror(failed),
                    "check host and port");
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> freed(found, freeaddrinfo);
  sockaddr_in out{};
  std::memcpy(&out, found->ai_addr, sizeof out);
  return out;
}

}  // namespace

Result<ByteLink> ByteLink::open(const std::string& port, const SerialLine& line) {
  if (port.starts_with("tcp://")) return open_tcp(port);
  if (port.starts_with("udp://")) return open_udp(port);
  return open_serial(port, line);
}

Result<ByteLink> ByteLink::open_serial(const std::string& port, const SerialLine& line) {
  const auto speed = speeds().find(line.baud);
  if (speed == speeds().end())
    return Error{ErrorCode::kConfiguration, port,
                 "a baud rate of " + std::to_string(line.baud) + " is not known",
                 "use one of 1200 to 921600"};
  // Not blocking: a line without carrier would hold open() up.
  Descriptor fd(::open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (fd.get() < 0) return of_errno(port, errno);
  termios settings{};
  if (tcgetattr(fd.get(), &settings) != 0)
    return Error{ErrorCode::kConfiguration, port, "is no serial line", "check 'port'"};
  // ioctl() keeps others out, but not root; the lock does.
  if (flock(fd.get(), LOCK_EX | LOCK_NB) != 0 || ioctl(fd.get(), TIOCEXCL) != 0)
    return of_errno(port, EBUSY);
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSIZE | PARENB | PARODD | CSTOPB | CRTSCTS);
  settings.c_cflag |= line.data_bits == 7 ? CS7 : CS8;
  if (line.parity != 'N') settings.c_cflag |= PARENB;
  if (line.parity == 'O') settings.c_cflag |= PARODD;
  // Characters of wrong parity come as 0, which is part of no text telegram.
  if (line.parity != 'N') settings.c_iflag |= INPCK;
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  cfsetispeed(&settings, speed->second);
  cfsetospeed(&settings, speed->second);
  if (tcsetattr(fd.get(), TCSANOW, &settings) != 0) return of_errno(port, errno);
  tcflush(fd.get(), TCIOFLUSH);
  ByteLink link(fd.release(), port);
  link.baud_ = line.baud;
  return link;
}

Result<ByteLink> ByteLink::open_tcp(const std::string& port) {
  const auto address = address_of(port, SOCK_STREAM);
  if (!address) return address.error();
  Descriptor fd(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0) return of_errno(port, errno);
  const int on = 1;
  setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  setsockopt(fd.get(), SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
  if (connect(fd.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0) {
    if (errno != EINPROGRESS) return of_errno(port, errno);
    pollfd waiting{fd.get(), POLLOUT, 0};
    if (poll(&waiting, 1, kConnectMs) <= 0) return of_errno(port, ETIMEDOUT);
    int failed = 0;
    socklen_t size = sizeof failed;
    getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &failed, &size);
    if (failed != 0) return of_errno(port, failed);
  }
  return ByteLink(fd.release(), port);
}

Result<ByteLink> ByteLink::open_udp(const std::string& port) {
  auto address = address_of(port, SOCK_DGRAM);
  if (!address) return address.error();
  Descriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (fd.get() < 0) return of_errno(port, errno);
  const std::uint32_t from = address->sin_addr.s_addr;
  address->sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof *address) != 0)
    return of_errno(port, errno);
  ByteLink link(fd.release(), port);
  link.datagrams_ = true;
  link.from_ = from;
  return link;
}

ByteLink::~ByteLink() {
  if (fd_ >= 0) close(fd_);
}

ByteLink::ByteLink(ByteLink&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      port_(std::move(other.port_)),
      baud_(other.baud_),
      datagrams_(other.datagrams_),
      from_(other.from_),
      strangers_(other.strangers_) {}

Result<std::size_t> ByteLink::read(std::span<std::uint8_t> into, std::chrono::milliseconds limit) {
  pollfd waiting{fd_, POLLIN, 0};
  const int ready = poll(&waiting, 1, static_cast<int>(limit.count()));
  if (ready == 0 || (ready < 0 && errno == EINTR)) return std::size_t{0};
  if (ready < 0) return of_errno(port_, errno);
  ssize_t got = 0;
  if (datagrams_) {
    sockaddr_in source{};
    socklen_t size = sizeof source;
    got = recvfrom(fd_, into.data(), into.size(), MSG_TRUNC, reinterpret_cast<sockaddr*>(&source),
                   &size);
    if (got >= 0 && from_ != 0 && source.sin_addr.s_addr != from_) {
      ++strangers_;
      return std::size_t{0};
    }
    if (got > static_cast<ssize_t>(into.size())) return into.size();  // too long for a telegram
  } else {
    got = ::read(fd_, into.data(), into.size());
    // A line or connection that is ready and has nothing has ended.
    if (got == 0) return resource(port_, "was unplugged or closed", "it is tried again");
  }
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) {
    if ((waiting.revents & (POLLHUP | POLLERR)) != 0)
      return resource(port_, "was unplugged or closed", "it is tried again");
    return std::size_t{0};
  }
  if (got < 0 && errno == EIO)
    return resource(port_, "was unplugged or closed", "it is tried again");
  if (got < 0) return of_errno(port_, errno);
  return static_cast<std::size_t>(got);
}

Result<void> ByteLink::write(const std::string& bytes) {
  if (datagrams_) return {};
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = baud_ > 0 ? ::write(fd_, bytes.data() + done, bytes.size() - done)
                                : send(fd_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (n > 0) {
      done += static_cast<std::size_t>(n);
      continue;
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR)
      return resource(port_, "was unplugged or closed", "it is tried again");
    pollfd waiting{fd_, POLLOUT, 0};
    if (poll(&waiting, 1, kWriteMs) <= 0)
      return resource(port_, "takes no characters", "check its wiring and flow control");
  }
  return {};
}

std::int64_t ByteLink::line_time_ns(std::size_t bytes) const {
  if (baud_ <= 0) return 0;
  return static_cast<std::int64_t>(bytes) * kBitsOfCharacter * 1'000'000'000 / baud_;
}

}  // namespace crane
