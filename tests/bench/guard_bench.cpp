// SPDX-License-Identifier: Apache-2.0
// What the check before Fast DDS costs of a frame's way over UDP: its 87 datagrams of 5.5 MB, each
// sent over loopback and received, then checked; beside it such a frame from writer to reader.
// usage: tests/bench/run --benchmark_filter=Guard

#include <arpa/inet.h>
#include <benchmark/benchmark.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/clock.hpp"
#include "base/wakeup.hpp"
#include "bounds.h"
#include "dds/endpoints.hpp"
#include "rtps_guard/guard.hpp"

namespace crane {
namespace {

using Datagram = std::vector<std::uint8_t>;

constexpr std::uint32_t kFrameBytes = 5'529'668, kFragment = 64'000;

void put32(Datagram& d, std::uint32_t v) {
  for (int i = 0; i < 4; ++i) d.push_back(static_cast<std::uint8_t>(v >> (8 * i)));
}

/// DATA_FRAG by DATA_FRAG, as Fast DDS sends a sample that is larger than a datagram.
std::vector<Datagram> frame(std::uint32_t number) {
  std::vector<Datagram> out;
  for (std::uint32_t first = 0; first * kFragment < kFrameBytes; ++first) {
    const std::uint32_t bytes = std::min(kFragment, kFrameBytes - first * kFragment);
    Datagram d = {'R', 'T', 'P', 'S', 2, 2, 1, 15, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0x16, 1};
    const std::uint32_t length = 32 + bytes;
    d.push_back(static_cast<std::uint8_t>(length & 255U));
    d.push_back(static_cast<std::uint8_t>(length >> 8U));
    for (const std::uint32_t v :
         {0x001C0000U, 1U, 2U, 0U, number, first + 1, kFragment << 16U | 1U, kFrameBytes})
      put32(d, v);
    d.resize(d.size() + bytes);
    out.push_back(std::move(d));
  }
  return out;
}

Datagram announcement() {
  Datagram d = {'R', 'T', 'P', 'S', 2, 2,  1,  15, 1,    2, 3,  4,
                5,   6,   7,   8,   9, 10, 11, 12, 0x15, 5, 60, 0};
  for (const std::uint32_t v :
       {0x00100000U, 0xC7000100U, 0xC2000100U, 0U, 1U, 0x00000300U, 0x00080002U, 10U, 0U,
        0x00040058U, 0xC3FU, 0x00040016U, 0x00000F01U, 0x00000001U, 0U})
    put32(d, v);
  return d;
}

/// From write() until it is taken, over UDP, as between two hosts; guarded. Negative: none came.
double frame_over_udp_ms() {
  dds::Settings settings;
  settings.domain = 96;
  settings.shared_memory = false;
  const auto camera = *dds::Participant::create(settings, "camera");
  const auto stereo = *dds::Participant::create(settings, "stereo");
  auto writer = *dds::Writer<dds::StereoFrameTopic>::create(camera);
  Wakeup wakeup;
  auto reader = *dds::Reader<dds::StereoFrameTopic>::create(stereo, &wakeup);
  auto sample = std::make_unique<dds::StereoFrame>();
  sample->encoding(v1::ENCODING_BGR8);
  sample->width(1280);
  sample->height(720);
  sample->exposure_time_ns(1);
  sample->left().resize(2'764'800);
  sample->right().resize(2'764'800);
  constexpr int kFrames = 50;
  double sum_ms = 0;
  for (int n = -5; n < kFrames; ++n) {  // at first they find each other
    const Stopwatch watch;
    bool taken = false;
    (void)writer.write(*sample);
    while (!taken && watch.ms() < 2000) {
      taken = bool(reader.take());
      if (!taken) (void)wakeup.wait_for(std::chrono::milliseconds(100));
    }
    if (n >= 0 && !taken) return -1;
    if (n >= 0) sum_ms += watch.ms();
  }
  return sum_ms / kFrames;
}

void GuardOfAFrame(benchmark::State& state) {
  const int in = socket(AF_INET, SOCK_DGRAM, 0), out = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (bind(in, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0)
    return state.SkipWithError("no UDP port on the loopback");
  getsockname(in, reinterpret_cast<sockaddr*>(&address), &size);
  Datagram buffer(65'536);
  // As from a participant that announced itself: each fragment is remembered.
  guard::Guard check;
  guard::Verdict verdict;
  check.check(announcement(), 0x7F000001, guard::Clock::now(), verdict);
  if (verdict.refusal != guard::Refusal::kNone)
    return state.SkipWithError("the announcement was refused");
  std::uint32_t number = 0;
  std::uint64_t refused = 0;
  double check_ms = 0, udp_ms = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const auto datagrams = frame(++number);
    state.ResumeTiming();
    for (const Datagram& d : datagrams) {
      const Stopwatch whole;
      sendto(out, d.data(), d.size(), 0, reinterpret_cast<sockaddr*>(&address), sizeof address);
      const ssize_t got = recv(in, buffer.data(), buffer.size(), 0);
      udp_ms += whole.ms();
      // What has just been received, as the transport hands it on.
      const Stopwatch checking;
      check.check({buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))}, 0x7F000001,
                  guard::Clock::now(), verdict);
      check_ms += checking.ms();
      refused += verdict.refusal == guard::Refusal::kNone ? 0 : 1;
    }
  }
  close(in);
  close(out);
  static const double kFrameMs = frame_over_udp_ms();
  if (kFrameMs <= 0) return state.SkipWithError("no frame came over UDP");
  if (refused > 0) state.SkipWithError("a sound datagram was refused");
  state.counters["check_us"] = 1e3 * check_ms / double(state.iterations());
  state.counters["udp_us"] = 1e3 * udp_ms / double(state.iterations());
  state.counters["frame_us"] = 1e3 * kFrameMs;
  state.counters["percent_of_sockets"] = 100 * check_ms / udp_ms;
  state.counters["percent_of_frame"] = 100 * check_ms / double(state.iterations()) / kFrameMs;
}
BENCHMARK(GuardOfAFrame)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace crane
