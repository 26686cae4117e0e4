// SPDX-License-Identifier: Apache-2.0
// What those who run services rely on: systemd, signals, health, logs.

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "crane/client/map.hpp"
#include "service/health.hpp"
#include "system/live_services.hpp"

namespace crane::test {
namespace {

using namespace std::chrono_literals;
using Steady = std::chrono::steady_clock;

const std::vector<std::string> kServices = {"camera",    "rangefinder", "stereo",   "mapper",
                                            "clearance", "ros2-mirror", "discovery"};

TEST(Operability, EveryProgramSaysItsVersionAndBuildType) {
  const TempFolder folder;
  std::vector<std::string> programs = {"cranemap"};
  for (const std::string& s : kServices) programs.push_back("cranemap-" + s);
  for (const std::string& program : programs) {
    Process process({program, "--version"}, folder / "version.txt");
    EXPECT_EQ(process.wait(10), 0) << program;
    EXPECT_NE(process.output().find("0.1.0 ("), std::string::npos) << program;
  }
}

TEST(Operability, TheMapperTellsSystemdThatItIsReadyAndThatItsLoopTurns) {
  const TempFolder folder;
  const std::string path = folder / "notify";
  const int s = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(bind(s, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  const timeval limit{10, 0};
  setsockopt(s, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << next_domain() << "}\n";
  setenv("NOTIFY_SOCKET", path.c_str(), 1);
  Process mapper(
      {"cranemap-mapper", "--config", folder / "site.yaml", "--calibration", rig_recording()},
      folder / "mapper.txt");
  unsetenv("NOTIFY_SOCKET");
  for (int i = 0; i < 3; ++i) {  // one a second
    char text[512] = "";
    ASSERT_GT(recv(s, text, sizeof text - 1, 0), 0) << mapper.output();
    EXPECT_NE(std::string(text).find("READY=1\nWATCHDOG=1\nSTATUS="), std::string::npos) << text;
  }
  close(s);
}

TEST(Operability, HealthZonesOnSighupAndAnOrderlyStopWithTheMapSaved) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain, "3", true);
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  ASSERT_TRUE(eventually(20s, [&] { return map->status().frames_integrated > 3; }));
  for (int service = 1; service <= 4; ++service)
    EXPECT_TRUE(ask_health("127.0.0.1", 9460 + service)) << service;
  EXPECT_TRUE(map->zones().empty());

  Process& mapper = services.front();
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain
                                      << "}\nzones: [{id: 4, name: gate, corners: [{x: 0, y: 0}, "
                                         "{x: 1, y: 0}, {x: 1, y: 1}]}]\n";
  mapper.signal(SIGHUP);
  EXPECT_TRUE(eventually(5s, [&] { return map->zones().size() == 1 && map->zones()[0].id == 4; }));
  std::ofstream(folder / "site.yaml") << "zones: nonsense\n";
  mapper.signal(SIGHUP);
  EXPECT_TRUE(eventually(5s, [&] {
    return mapper.output().find("SIGHUP: the zones stay as they are") != std::string::npos;
  })) << mapper.output();
  EXPECT_EQ(map->zones().size(), 1U);

  const auto begin = Steady::now();
  for (Process& s : services) s.signal(SIGTERM);
  for (Process& s : services) EXPECT_EQ(s.wait(10), 0) << s.output();
  const double took_s = std::chrono::duration<double>(Steady::now() - begin).count();
  EXPECT_LT(took_s, 4) << "2 s are promised; this machine may be busy";
  EXPECT_TRUE(std::filesystem::exists(folder / "state/account.yaml"));
}

TEST(Operability, ServeStartsAgainWhatIsKilledAndLogsJson) {
  const TempFolder folder;
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << next_domain() << "}\n";
  Process serve({"cranemap", "serve", "--log-json", "--config", folder / "site.yaml", "--recording",
                 rig_recording(), "mapper", "stereo"},
                folder / "serve.txt");
  pid_t stereo = 0;
  ASSERT_TRUE(
      eventually(10s, [&] { return (stereo = child_named(serve.pid(), "cranemap-stereo")) != 0; }));
  kill(stereo, SIGKILL);
  EXPECT_TRUE(eventually(10s, [&] {
    const pid_t again = child_named(serve.pid(), "cranemap-stereo");
    return again != 0 && again != stereo;
  }));
  // Both have said what they do, and the new one is at work: a moment ago it may not have said a
  // word.
  EXPECT_TRUE(eventually(60s, [&] {
    const std::string said = serve.output();
    const std::size_t killed = said.find("was killed by signal 9");
    return killed != std::string::npos && said.find("serving crane") != std::string::npos &&
           said.find("searching ", killed) != std::string::npos;
  })) << serve.output();
  serve.signal(SIGTERM);
  EXPECT_EQ(serve.wait(10), 0);
  std::istringstream lines(serve.output());
  int count = 0;
  bool said = false;
  for (std::string line; std::getline(lines, line); ++count) {
    const auto entry = nlohmann::json::parse(line, nullptr, false);
    ASSERT_FALSE(entry.is_discarded()) << line;
    said |= entry["text"].get<std::string>().find("was killed by signal 9") != std::string::npos;
  }
  EXPECT_GT(count, 4);
  EXPECT_TRUE(said);
}

/// One thread of a process of ours, by its name, that makes no progress while this lives.
class StoppedThread {
 public:
  /// 0: there is none of this name.
  static pid_t find(pid_t process, const std::string& name) {
    const std::string tasks = "/proc/" + std::to_string(process) + "/task";
    for (const auto& task : std::filesystem::directory_iterator(tasks)) {
      std::string comm;
      std::ifstream file(task.path() / "comm");
      if (std::getline(file, comm) && comm == name) return std::stoi(task.path().filename());
    }
    return 0;
  }
  explicit StoppedThread(pid_t thread) : thread_(thread) {
    if (ptrace(PTRACE_SEIZE, thread_, nullptr, nullptr) != 0) return;
    ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr);
    stopped_ = waitpid(thread_, nullptr, __WALL) == thread_;
  }
  ~StoppedThread() { ptrace(PTRACE_DETACH, thread_, nullptr, nullptr); }
  StoppedThread(const StoppedThread&) = delete;
  StoppedThread& operator=(const StoppedThread&) = delete;
  [[nodiscard]] bool stopped() const { return stopped_; }

 private:
  pid_t thread_;
  bool stopped_ = false;
};

TEST(Operability, HealthFailsWhileAFollowerOrAWriterHangsAndTheServicesLoopTurns) {
  const TempFolder folder;
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << next_domain() << "}\n";
  Process mapper(
      {"cranemap-mapper", "--config", folder / "site.yaml", "--calibration", rig_recording()},
      folder / "mapper.txt");
  Process clearance({"cranemap-clearance", "--config", folder / "site.yaml"},
                    folder / "clearance.txt");
  constexpr int kMapper = 9464;
  constexpr int kClearance = 9465;
  const auto healthy = [](int port) { return ask_health("127.0.0.1", port).ok(); };
  const auto says = [](int port, const std::string& text) {
    const auto health = ask_health("127.0.0.1", port);
    return !health && health.error().what.find(text) != std::string::npos;
  };
  ASSERT_TRUE(eventually(20s, [&] { return healthy(kMapper) && healthy(kClearance); }));
  {
    pid_t heartbeat = 0;
    pid_t following = 0;
    ASSERT_TRUE(eventually(20s, [&] {
      heartbeat = StoppedThread::find(mapper.pid(), "heartbeat");
      following = StoppedThread::find(clearance.pid(), "map follower");
      return heartbeat != 0 && following != 0;
    }));
    const StoppedThread writer(heartbeat);
    const StoppedThread follower(following);
    if (!writer.stopped() || !follower.stopped()) GTEST_SKIP() << "no ptrace on this machine";
    EXPECT_TRUE(eventually(60s, [&] { return says(kMapper, "heartbeat hangs"); }));
    EXPECT_TRUE(eventually(60s, [&] { return says(kClearance, "map follower hangs"); }));
  }
  EXPECT_TRUE(eventually(20s, [&] { return healthy(kMapper) && healthy(kClearance); }));
}

/// Holds connections to a port, each with a request that never ends, until it goes.
class SlowClients {
 public:
  SlowClients(int port, int count) : sockets_(count, -1) {
    thread_ = std::jthread([this, port](const std::stop_token& stop) {
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_port = htons(static_cast<std::uint16_t>(port));
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      for (; !stop.stop_requested(); std::this_thread::sleep_for(20ms))
        for (int& s : sockets_) {
          if (s >= 0 && send(s, "X:1\r\n", 5, MSG_NOSIGNAL | MSG_DONTWAIT) == 5) continue;
          if (s >= 0) close(s);
          s = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
          if (connect(s, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0) ++made_;
          send(s, "GET /healthz HTTP/1.1\r\n", 23, MSG_NOSIGNAL | MSG_DONTWAIT);
        }
      for (const int s : sockets_) close(s);
    });
  }
  [[nodiscard]] int made() const { return made_; }

 private:
  std::vector<int> sockets_;
  std::atomic<int> made_{0};
  std::jthread thread_;
};

TEST(Operability, SlowClientsNeitherStarveHealthNorHoldUpAStop) {
  const TempFolder folder;
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << next_domain() << "}\n";
  Process mapper(
      {"cranemap-mapper", "--config", folder / "site.yaml", "--calibration", rig_recording()},
      folder / "mapper.txt");
  constexpr int kPort = 9464;
  ASSERT_TRUE(eventually(20s, [&] { return ask_health("127.0.0.1", kPort).ok(); }));
  const SlowClients slow(kPort, 300);
  ASSERT_TRUE(eventually(20s, [&] { return slow.made() > 600; })) << "all are in, and come again";
  int answered = 0;
  for (int i = 0; i < 50; ++i) answered += ask_health("127.0.0.1", kPort).ok() ? 1 : 0;
  EXPECT_GE(answered, 48) << "of 50";
  mapper.signal(SIGTERM);
  const auto begin = Steady::now();
  EXPECT_EQ(mapper.wait(10), 0) << mapper.output();
  EXPECT_LT(Steady::now() - begin, 4s) << "2 s are promised; this machine may be busy";
}

TEST(Operability, ALogThatNobodyReadsStallsNothing) {
  const TempFolder folder;
  const std::string path = folder / "log";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const int reader = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  const int filler = open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
  while (write(filler, "full\n", 5) > 0) {
  }
  const std::string domain = next_domain();
  std::list<Process> services = live_services(folder, domain, "3");
  services.pop_front();  // the mapper: now one whose every line would wait for ever
  Process mapper(
      {"cranemap-mapper", "--config", folder / "site.yaml", "--calibration", rig_recording()},
      path);
  client::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(domain));
  std::string error;
  const auto map = client::Map::join(options, error);
  ASSERT_NE(map, nullptr) << error;
  ASSERT_TRUE(eventually(30s, [&] { return map->status().frames_integrated > 3; }));
  for (int i = 0; i < 50; ++i) {  // two lines each
    mapper.signal(SIGHUP);
    std::this_thread::sleep_for(10ms);
  }
  const auto before = map->status().frames_integrated;
  EXPECT_TRUE(eventually(30s, [&] { return map->status().frames_integrated > before + 3; }));
  EXPECT_TRUE(map->status().valid);
  EXPECT_TRUE(ask_health("127.0.0.1", 9464));
  mapper.signal(SIGTERM);
  EXPECT_EQ(mapper.wait(10), 0) << "nor its end";
  close(reader);
  close(filler);
}

TEST(Operability, StatusAndDoctorSayHowMuchTheGuardRefused) {
  const TempFolder folder;
  const std::string domain = next_domain();
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain << "}\n";
  Process mapper(
      {"cranemap-mapper", "--config", folder / "site.yaml", "--calibration", rig_recording()},
      folder / "mapper.txt");
  const auto status = [&] {
    return run({"status", "--config", folder / "site.yaml", "--wait", "1"}, folder.path()).output;
  };
  ASSERT_TRUE(eventually(20s, [&] {
    return status().find("datagrams_refused: 0\ndatagrams_refused_by:\n  mapper: 0\n") !=
           std::string::npos;
  })) << status();
  const int out = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * std::stoi(domain) + 10));
  for (int i = 0; i < 3; ++i)
    ASSERT_EQ(sendto(out, "no RTPS", 7, 0, reinterpret_cast<sockaddr*>(&to), sizeof to), 7);
  close(out);
  EXPECT_TRUE(eventually(10s, [&] {
    return status().find("datagrams_refused: 3\ndatagrams_refused_by:\n  mapper: 3\n") !=
           std::string::npos;
  })) << status();
  const Finished doctor =
      run({"doctor", "--config", folder / "site.yaml", "--seconds", "3"}, folder.path());
  EXPECT_EQ(doctor.code, 0) << "a warning";
  EXPECT_NE(doctor.output.find("mapper refused 3 since its start"), std::string::npos)
      << doctor.output;
}

TEST(Operability, TheDoctorNamesWhatIsWrong) {
  const TempFolder folder;
  std::ofstream(folder / "site.yaml")
      << "dds: {domain: " << next_domain()
      << ", network: plant, interfaces: [10.254.3.1], peers: [nowhere.invalid]}\n";
  const Finished bad =
      run({"doctor", "--config", folder / "site.yaml", "--seconds", "0"}, folder.path());
  EXPECT_EQ(bad.code, 3);
  EXPECT_NE(bad.output.find("10.254.3.1 is no address of this host"), std::string::npos)
      << bad.output;
  EXPECT_NE(bad.output.find("'nowhere.invalid' has no address"), std::string::npos) << bad.output;
  const Finished good = run({"doctor", "--domain", next_domain(), "--seconds", "1"}, folder.path());
  EXPECT_EQ(good.code, 0) << good.output;
}

}  // namespace
}  // namespace crane::test
