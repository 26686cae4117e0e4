// SPDX-License-Identifier: Apache-2.0
#pragma once

// Inside of the server: Boost is seen here.

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <list>
#include <memory>
#include <mutex>

#include "http/feed.hpp"
#include "http/server.hpp"

namespace crane::http {

struct Tally {
  std::atomic<std::uint64_t> answered{0}, refused{0}, closed{0}, cut_off{0};
};

/// One WebSocket. Lives as long as an operation of it waits; all of it runs on its strand.
class Stream : public std::enable_shared_from_this<Stream> {
 public:
  using Upgrade = boost::beast::http::request<boost::beast::http::string_body>;

  Stream(boost::beast::tcp_stream stream, std::unique_ptr<Feed> feed, const Limits& limits,
         Tally& tally);
  void begin(Upgrade request);
  /// There may be news. Any thread.
  void poke();

 private:
  void listen();
  void say_next();
  void cut_off();

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  std::unique_ptr<Feed> feed_;
  Tally& tally_;
  Upgrade request_;
  boost::beast::flat_buffer heard_;
  Message message_;  ///< that is on its way
  bool saying_ = false, open_ = false;
  std::atomic<bool> poked_{false};
};

/// Those that there are. Any thread.
class Streams {
 public:
  /// False: no room.
  bool add(const std::shared_ptr<Stream>& stream, std::size_t most);
  void poke();
  [[nodiscard]] std::size_t count() const;

 private:
  mutable std::mutex mutex_;
  std::list<std::weak_ptr<Stream>> streams_;
};

}  // namespace crane::http
