// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <utility>

namespace crane {

/// Requests that wait, one client's after another's in turn: who asks without end waits behind
/// itself, not others behind it. Bounded: what does not fit is refused. One thread.
/// `Client`: who DDS says that it is from, not who a request says that it is.
template <class Client, class Request>
class FairQueue {
 public:
  /// So many requests of one client, and so many clients, may wait.
  FairQueue(std::size_t most_each, std::size_t most_clients)
      : most_each_(most_each), most_clients_(most_clients) {}

  /// False when there is no room for it.
  bool push(const Client& client, Request request) {
    const auto known = waiting_.find(client);
    if (known == waiting_.end() ? waiting_.size() >= most_clients_
                                : known->second.size() >= most_each_)
      return false;
    waiting_[client].push_back(std::move(request));
    return true;
  }
  /// The next one, of the client after the one whose turn it was.
  std::optional<Request> pop() {
    if (waiting_.empty()) return std::nullopt;
    auto next = last_ ? waiting_.upper_bound(*last_) : waiting_.begin();
    if (next == waiting_.end()) next = waiting_.begin();
    last_ = next->first;
    Request request = std::move(next->second.front());
    next->second.pop_front();
    if (next->second.empty()) waiting_.erase(next);
    return request;
  }
  [[nodiscard]] bool empty() const { return waiting_.empty(); }

 private:
  std::size_t most_each_, most_clients_;
  std::map<Client, std::deque<Request>> waiting_;
  std::optional<Client> last_;
};

}  // namespace crane
