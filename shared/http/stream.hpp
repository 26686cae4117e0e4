// SPDX-License-Identifier: Apache-2.0
#pragma once

// Inside of the server: Boost is seen here.

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <mutex>
#include <string>

#include "http/feed.hpp"
#include "http/server.hpp"

namespace crane::http {

/// What a connection is: bytes in the clear, or by TLS.
using PlainSocket = boost::beast::tcp_stream;
using SecureSocket = boost::beast::ssl_stream<boost::beast::tcp_stream>;

struct Tally {
  std::atomic<std::uint64_t> answered{0}, refused{0}, closed{0}, cut_off{0};
};

/// One WebSocket.
class Stream {
 public:
  virtual ~Stream() = default;
  Stream() = default;
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  /// There may be news. Any thread.
  virtual void poke() = 0;
};

/// Lives as long as an operation of it waits; all of it runs on its strand.
template <class Socket>
class StreamOn : public Stream, public std::enable_shared_from_this<StreamOn<Socket>> {
 public:
  using Upgrade = boost::beast::http::request<boost::beast::http::string_body>;

  /// `protocol`: that is agreed on; may be empty.
  StreamOn(Socket stream, std::unique_ptr<Feed> feed, const std::string& protocol,
           const Limits& limits, Tally& tally);
  void begin(Upgrade request);
  void poke() override;

 private:
  void listen();
  void say_next();
  void cut_off();
  [[nodiscard]] bool stalls() const;

  boost::beast::websocket::stream<Socket> socket_;
  std::unique_ptr<Feed> feed_;
  Tally& tally_;
  Upgrade request_;
  boost::beast::flat_buffer heard_;
  Message message_;  ///< that is on its way
  bool saying_ = false, open_ = false;
  std::chrono::steady_clock::time_point saying_since_{};
  std::chrono::milliseconds longest_;  ///< that a message may be on its way
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
