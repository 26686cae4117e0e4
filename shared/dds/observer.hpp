// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "dds/participant.hpp"

namespace crane::dds {

/// Looks on at who is on the network and what they read and write, without being one of them. For
/// finding out why somebody gets no data.
class NetworkObserver {
 public:
  static Result<std::unique_ptr<NetworkObserver>> create(const Settings& settings);
  ~NetworkObserver();

  /// By which it looks on, and others may read.
  [[nodiscard]] const std::shared_ptr<Participant>& participant() const;

  struct Peer {
    std::string name, guid;
    bool refused = false;  ///< by DDS Security
  };
  [[nodiscard]] std::vector<Peer> peers() const;
  /// Why a reader or writer of a topic of ours meets nobody of this crane, one line each.
  [[nodiscard]] std::vector<std::string> mismatches() const;

 private:
  struct Impl;
  explicit NetworkObserver(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::dds
