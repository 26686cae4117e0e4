// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.hpp"

namespace crane {

/// Where the device can be reached: a pseudo-terminal under a name, a TCP port that is listened on,
/// or datagrams sent to a port.
class Outlet {
 public:
  explicit Outlet(std::string port) : port_(std::move(port)) {}
  ~Outlet() { unplug(); }
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  [[nodiscard]] bool plugged() const { return fd_ >= 0 || listener_ >= 0; }

  Result<void> plug();
  void unplug();
  std::string read();
  /// What nobody takes is lost, as on a line.
  void write(const std::string& bytes);

 private:
  Result<void> refuse(const std::string& why);
  Result<void> plug_socket();
  void accept_one();
  void drop();
  std::string port_;
  int fd_ = -1, listener_ = -1;
  bool linked_ = false;
};

}  // namespace crane
