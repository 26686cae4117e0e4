// SPDX-License-Identifier: Apache-2.0
// All services of a crane, and somebody beside them who says again what they say, a little
// otherwise each time, in their names.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <thread>

#include "../rtps/capture.hpp"
#include "../rtps/mutate.hpp"
#include "../rtps/variants.hpp"
#include "base/clock.hpp"
#include "dds/endpoints.hpp"
#include "service/health.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;

/// Number of a service behind the HTTP port, and its program.
const std::map<int, std::string> kServices = {{1, "cranemap-camera"},
                                              {2, "cranemap-rangefinder"},
                                              {3, "cranemap-stereo"},
                                              {4, "cranemap-mapper"},
                                              {5, "cranemap-clearance"}};

class Crane {
 public:
  Crane() {
    std::ofstream(folder_ / "site.yaml")
        << "dds: {domain: " << domain_ << ", shared_memory: false}\nhttp: {port: " << http_
        << "}\n";
    serve_.emplace(std::vector<std::string>{"cranemap", "serve", "--config", folder_ / "site.yaml",
                                            "--recording", rig_recording(), "mapper", "stereo",
                                            "rangefinder", "camera", "clearance"},
                   folder_ / "serve.txt");
  }
  [[nodiscard]] std::uint32_t domain() const {
    return static_cast<std::uint32_t>(std::stoi(domain_));
  }
  /// By their programs; 0 is none.
  [[nodiscard]] std::map<std::string, pid_t> processes() const {
    std::map<std::string, pid_t> out;
    for (const auto& [number, name] : kServices) out[name] = child_named(serve_->pid(), name);
    return out;
  }
  [[nodiscard]] std::string unhealthy() const {
    std::string out;
    for (const auto& [number, name] : kServices)
      if (const auto health = ask_health("127.0.0.1", http_ + number); !health)
        out += name + ": " + health.error().text() + "; ";
    return out;
  }
  [[nodiscard]] long resident_mb() const {
    long sum = 0;
    for (const auto& [name, pid] : processes()) {
      std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
      long pages = 0;
      file >> pages >> pages;
      sum += pages * sysconf(_SC_PAGESIZE) >> 20U;
    }
    return sum;
  }
  [[nodiscard]] std::string output() const { return serve_->output(); }

 private:
  TempFolder folder_;
  std::string domain_ = next_domain();
  int http_ = 20'000 + getpid() % 20'000;
  std::optional<Process> serve_;
};

/// A controller without our library that has just come. -1: no answer.
int verdict_for_a_newcomer(std::uint32_t domain) {
  dds::Settings settings;
  settings.domain = domain;
  settings.shared_memory = false;
  const auto participant = *dds::Participant::create(settings, "controller");
  auto requests = *dds::Writer<dds::ClearanceRequestTopic>::create(participant);
  auto replies = *dds::Reader<dds::ClearanceReplyTopic>::create(participant, nullptr);
  v1::ClearanceRequest request;
  request.crane(1);
  request.client(static_cast<std::uint32_t>(getpid()));
  request.load_size_x_m(0.3);
  request.load_size_y_m(0.3);
  request.load_size_z_m(0.2);
  for (const double x : {1.45, 1.95}) {
    v1::ClearancePose pose;
    pose.x_m(x);
    pose.y_m(1.8);
    pose.z_m(0.3);
    request.path().push_back(pose);
  }
  int verdict = -1;
  (void)eventually(30s, [&] {
    request.sequence_number(request.sequence_number() + 1);
    request.time_ns(SystemClock().now());
    (void)requests.write(request);
    while (const auto reply = replies.take())
      if ((*reply)->client() == request.client()) verdict = int((*reply)->verdict());
    return verdict >= 0;
  });
  return verdict;
}

/// CRANEMAP_DATAGRAMS=5000000 for the long run.
long datagrams(long usual) {
  const char* wanted = std::getenv("CRANEMAP_DATAGRAMS");
  return wanted != nullptr ? std::atol(wanted) : usual;
}

TEST(HostileNetwork, AllServicesLiveAreHealthyAndAnswerThroughMutatedTraffic) {
  Capture capture;
  if (!capture.works()) GTEST_SKIP() << "capturing on loopback needs CAP_NET_RAW";
  const Crane crane;
  ASSERT_TRUE(eventually(90s, [&] { return verdict_for_a_newcomer(crane.domain()) > 0; }))
      << crane.output();
  std::vector<Datagram> traffic;
  std::map<std::pair<int, std::size_t>, int> alike;
  for (Captured& c : capture.take(crane.domain()))
    if (c.bytes.size() < 3000 || ++alike[{c.bytes[20], c.bytes.size() / 1000}] <= 3)
      traffic.push_back(std::move(c.bytes));
  ASSERT_GT(traffic.size(), 200U);
  for (Datagram& d : variants(traffic, 5)) traffic.push_back(std::move(d));
  const auto processes = crane.processes();
  ASSERT_EQ(crane.unhealthy(), "");
  const long before = crane.resident_mb();

  const int out = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  Mutator mutator(traffic, 5);
  const auto check = [&](long i) {
    const std::string when = "after " + std::to_string(i) + " datagrams: ";
    ASSERT_EQ(crane.processes(), processes) << when << crane.output();
    ASSERT_EQ(crane.unhealthy(), "") << when;
    ASSERT_GE(verdict_for_a_newcomer(crane.domain()), 0) << when << crane.output();
    ASSERT_LT(crane.resident_mb() - before, 200) << when;
    std::cout << when << crane.resident_mb() << " MB (" << before << " at first)" << std::endl;
  };
  const long count = datagrams(60'000);
  for (long i = 1; i <= count; ++i) {
    const Datagram d = mutator.next();
    // Of the first seven participants: metatraffic and users' (DDSI-RTPS 9.6.1).
    to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * crane.domain() + 10 + i % 14));
    (void)sendto(out, d.data(), d.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    if (i % 100 == 0) std::this_thread::sleep_for(2ms);
    if (i % 100'000 == 0) ASSERT_NO_FATAL_FAILURE(check(i));
  }
  close(out);
  ASSERT_NO_FATAL_FAILURE(check(count));
  // What lied is gone after a minute at most.
  EXPECT_TRUE(eventually(120s, [&] { return verdict_for_a_newcomer(crane.domain()) > 0; }))
      << crane.output();
}

}  // namespace
}  // namespace crane::test
