// SPDX-License-Identifier: Apache-2.0
// A bad network cable between two hosts that are network namespaces: two TAP devices, and what goes
// in at one comes out at the other, late, doubled, out of order, or not at all. usage: bad-wire
// DEVICE_A DEVICE_B [loss % [delay ms [jitter ms [doubled %]]]] Makes both devices where it runs,
// says "ready", and carries until it is ended.

#include <fcntl.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <queue>
#include <random>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

struct Packet {
  Clock::time_point due;
  int to = 0;
  std::vector<char> bytes;
  bool operator>(const Packet& other) const { return due > other.due; }
};

int make_tap(const char* name) {
  const int fd = open("/dev/net/tun", O_RDWR | O_NONBLOCK);
  ifreq request{};
  request.ifr_flags = IFF_TAP | IFF_NO_PI;
  std::strncpy(request.ifr_name, name, IFNAMSIZ - 1);
  if (fd < 0 || ioctl(fd, TUNSETIFF, &request) != 0) {
    std::perror(name);
    std::exit(77);
  }
  return fd;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const auto number = [&](int i) { return argc > i ? std::atof(argv[i]) : 0.0; };
  const double loss = number(3) / 100, delay_ms = number(4), jitter_ms = number(5);
  const double doubled = number(6) / 100;
  const int fd[2] = {make_tap(argv[1]), make_tap(argv[2])};
  std::printf("ready\n");
  std::fflush(stdout);

  std::mt19937 random(1);  // the same cable every time
  std::uniform_real_distribution<double> uniform(0, 1);
  std::priority_queue<Packet, std::vector<Packet>, std::greater<>> flying;
  std::vector<char> buffer(70'000);
  for (;;) {
    int wait_ms = 1000;
    if (!flying.empty()) {
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(flying.top().due - Clock::now());
      wait_ms = std::max(0, static_cast<int>(left.count()));
    }
    pollfd ends[2] = {{fd[0], POLLIN, 0}, {fd[1], POLLIN, 0}};
    poll(ends, 2, wait_ms);
    for (int from = 0; from < 2; ++from)
      for (ssize_t size; (size = read(fd[from], buffer.data(), buffer.size())) > 0;) {
        if (uniform(random) < loss) continue;
        for (int copies = uniform(random) < doubled ? 2 : 1; copies > 0; --copies) {
          const double late_ms = delay_ms + jitter_ms * uniform(random);
          flying.push({Clock::now() + std::chrono::microseconds(long(late_ms * 1000)),
                       fd[1 - from],
                       {buffer.data(), buffer.data() + size}});
        }
      }
    for (; !flying.empty() && flying.top().due <= Clock::now(); flying.pop()) {
      const Packet& p = flying.top();
      if (write(p.to, p.bytes.data(), p.bytes.size()) < 0) continue;  // that end is down: lost
    }
  }
}
