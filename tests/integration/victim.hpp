// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "../rtps/build.hpp"
#include "dds/endpoints.hpp"
#include "domain.hpp"

namespace crane::test {

using namespace std::chrono_literals;

/// guard_victim.cpp, a process of its own.
class Victim {
 public:
  /// `host`: a network namespace to be in, with all its interfaces; else on loopback.
  Victim(const char* guard, std::uint32_t domain, const std::string& security = "",
         const std::string& host = "")
      : pid_(fork()) {
    if (pid_ == 0) {
      std::vector<std::string> words = {CRANEMAP_BIN_DIR "/guard_victim", std::to_string(domain),
                                        guard, host.empty() ? "loopback" : "all"};
      if (!host.empty()) words.insert(words.begin(), {"ip", "netns", "exec", host});
      if (!security.empty()) words.push_back(security);
      std::vector<char*> arguments;
      for (std::string& word : words) arguments.push_back(word.data());
      arguments.push_back(nullptr);
      execvp(arguments[0], arguments.data());
      _exit(127);
    }
    std::this_thread::sleep_for(500ms);
  }
  ~Victim() {
    if (!alive()) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Victim(const Victim&) = delete;
  Victim& operator=(const Victim&) = delete;

  bool alive() {
    if (!ended_) ended_ = waitpid(pid_, &status_, WNOHANG) == pid_;
    return !ended_;
  }
  [[nodiscard]] int status() const { return status_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] long resident_mb() const {
    std::ifstream file("/proc/" + std::to_string(pid_) + "/statm");
    long pages = 0;
    file >> pages >> pages;
    return pages * sysconf(_SC_PAGESIZE) >> 20U;
  }

 private:
  pid_t pid_;
  bool ended_ = false;
  int status_ = 0;
};

/// To the ports that participants of a domain listen to.
class Attacker {
 public:
  explicit Attacker(std::uint32_t domain) : socket_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    for (const std::uint32_t offset : {0U, 10U, 11U, 12U, 13U})  // DDSI-RTPS 9.6.1
      ports_.push_back(static_cast<std::uint16_t>(7400 + 250 * domain + offset));
  }
  ~Attacker() { close(socket_); }
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;
  void send(const Datagram& d) { send_to(d, ports_[next_++ % ports_.size()]); }
  void send_to(const Datagram& d, std::uint16_t port) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(port);
    (void)sendto(socket_, d.data(), d.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    if (++sent_ % 200 == 0) std::this_thread::sleep_for(3ms);
  }
  void send_everywhere(const Datagram& d) {
    for (const std::uint16_t port : ports_) send_to(d, port);
  }

 private:
  int socket_;
  std::vector<std::uint16_t> ports_;
  std::size_t next_ = 0, sent_ = 0;
};

/// Somebody who uses the victim as a client does: holds its tiles, commands it.
struct Friend {
  explicit Friend(std::uint32_t domain, const std::string& security = "") {
    dds::Settings settings;
    settings.domain = domain;
    settings.shared_memory = false;
    if (!security.empty()) {
      settings.security = security;
      settings.identity = "operator";
    }
    participant = *dds::Participant::create(settings, "friend");
    tiles.emplace(*dds::Reader<dds::MapTileTopic>::create(participant, nullptr));
    zones.emplace(*dds::Reader<dds::ZoneSetTopic>::create(participant, nullptr));
    commands.emplace(*dds::Writer<dds::ZoneCommandTopic>::create(participant));
    if (security.empty()) frames.emplace(*dds::Writer<dds::StereoFrameTopic>::create(participant));
    command.crane(1);
    command.action(v1::ZONE_SWITCH);
    command.zone().id(3);
  }
  /// All tiles, and an answer to a command. Announcements of peers that never were may have made
  /// the victim busy: half a minute at most.
  bool is_served() {
    seen_.clear();
    answered_ = false;
    const auto delivers = [this] {
      (void)commands->write(command);
      while (const auto tile = tiles->take()) seen_.insert((*tile)->tile_x());
      while (zones->take()) answered_ = true;
      return seen_.size() >= 50 && answered_;
    };
    return eventually(delivers) || eventually(delivers) || eventually(delivers);
  }

  /// What of it did not come.
  [[nodiscard]] std::string lacks() const {
    return std::to_string(seen_.size()) + " of 50 tiles, " + (answered_ ? "" : "not ") +
           "answered; matched: " + std::to_string(tiles->counts().matched) + " writers of tiles, " +
           std::to_string(zones->counts().matched) + " of zones, " +
           std::to_string(commands->matched()) + " readers of commands";
  }

  std::shared_ptr<dds::Participant> participant;
  std::optional<dds::Reader<dds::MapTileTopic>> tiles;
  std::optional<dds::Reader<dds::ZoneSetTopic>> zones;
  std::optional<dds::Writer<dds::ZoneCommandTopic>> commands;
  std::optional<dds::Writer<dds::StereoFrameTopic>> frames;
  v1::ZoneCommand command;

 private:
  std::set<int> seen_;
  bool answered_ = false;
};

}  // namespace crane::test
