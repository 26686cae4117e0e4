// SPDX-License-Identifier: Apache-2.0
#pragma once

// Inside of the server: Boost is seen here.

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <memory>

#include "http/router.hpp"
#include "http/stream.hpp"

namespace crane::http {

/// What connections share.
struct House {
  const Router& router;
  const Limits& limits;
  Tally& tally;
  Streams& streams;
  boost::asio::ssl::context* tls;  ///< nullptr: in the clear
};

/// One connection: its request, its answer, its end.
class Session {
 public:
  virtual ~Session() = default;
  Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Of the kind that the house wants. Lives as long as an operation of it waits.
  static std::shared_ptr<Session> make(boost::asio::ip::tcp::socket socket, const House& house);
  /// Any thread.
  virtual void begin() = 0;
  virtual void close() = 0;
};

}  // namespace crane::http
