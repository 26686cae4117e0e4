// SPDX-License-Identifier: Apache-2.0
#include "http/stream.hpp"

#include <boost/asio/dispatch.hpp>
#include <boost/asio/post.hpp>
#include <utility>

namespace crane::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using Failure = boost::system::error_code;

constexpr std::size_t kMostHeard = 4096;
/// Of the time that a silent client has: a large message may take a slow line so long.
constexpr int kSlowest = 6;

}  // namespace

template <class Socket>
StreamOn<Socket>::StreamOn(Socket stream, std::unique_ptr<Feed> feed, const std::string& protocol,
                           const Limits& limits, Tally& tally)
    : socket_(std::move(stream)),
      feed_(std::move(feed)),
      tally_(tally),
      longest_(kSlowest * limits.stream_idle) {
  websocket::stream_base::timeout times{};
  times.handshake_timeout = limits.deadline;
  times.idle_timeout = limits.stream_idle;
  times.keep_alive_pings = true;
  socket_.set_option(times);
  socket_.read_message_max(kMostHeard);
  if (!protocol.empty())
    socket_.set_option(
        websocket::stream_base::decorator([protocol](websocket::response_type& answer) {
          answer.set(beast::http::field::sec_websocket_protocol, protocol);
        }));
}

template <class Socket>
void StreamOn<Socket>::begin(Upgrade request) {
  request_ = std::move(request);
  beast::get_lowest_layer(socket_).expires_never();  // its own time-outs from here on
  socket_.async_accept(request_, [self = this->shared_from_this()](Failure failed) {
    if (failed) return;
    self->open_ = true;
    self->listen();
    self->say_next();
  });
}

template <class Socket>
void StreamOn<Socket>::poke() {
  if (poked_.exchange(true)) return;
  asio::post(socket_.get_executor(), [self = this->shared_from_this()] {
    self->poked_ = false;
    self->say_next();
  });
}

template <class Socket>
void StreamOn<Socket>::listen() {
  socket_.async_read(heard_, [self = this->shared_from_this()](Failure failed, std::size_t) {
    if (failed) {
      self->open_ = false;
      if (failed == beast::error::timeout || failed == websocket::error::message_too_big ||
          failed == websocket::error::buffer_overflow)
        ++self->tally_.cut_off;
      return;
    }
    const auto bytes = self->heard_.data();
    const bool sound = !self->stalls() &&
                       self->feed_->hear({static_cast<const char*>(bytes.data()), bytes.size()});
    self->heard_.consume(self->heard_.size());
    if (!sound) return self->cut_off();
    self->listen();
    self->say_next();
  });
}

template <class Socket>
void StreamOn<Socket>::say_next() {
  if (!open_ || saying_) return;
  auto next = feed_->next();
  if (!next) return;
  message_ = std::move(*next);
  saying_ = true;
  saying_since_ = std::chrono::steady_clock::now();
  socket_.binary(message_.binary);
  socket_.async_write(asio::buffer(message_.bytes),
                      [self = this->shared_from_this()](Failure failed, std::size_t) {
                        self->saying_ = false;
                        if (failed)
                          self->open_ = false;
                        else
                          self->say_next();
                      });
}

/// It talks, so it is not silent, but does not read.
template <class Socket>
bool StreamOn<Socket>::stalls() const {
  return saying_ && std::chrono::steady_clock::now() - saying_since_ > longest_;
}

template <class Socket>
void StreamOn<Socket>::cut_off() {
  ++tally_.cut_off;
  open_ = false;
  beast::get_lowest_layer(socket_).close();
}

template class StreamOn<PlainSocket>;
template class StreamOn<SecureSocket>;

bool Streams::add(const std::shared_ptr<Stream>& stream, std::size_t most) {
  const std::lock_guard lock(mutex_);
  streams_.remove_if([](const auto& one) { return one.expired(); });
  if (streams_.size() >= most) return false;
  streams_.push_back(stream);
  return true;
}

void Streams::poke() {
  const std::lock_guard lock(mutex_);
  for (const auto& one : streams_)
    if (const auto stream = one.lock()) stream->poke();
}

std::size_t Streams::count() const {
  const std::lock_guard lock(mutex_);
  std::size_t n = 0;
  for (const auto& one : streams_) n += one.expired() ? 0 : 1;
  return n;
}

}  // namespace crane::http
