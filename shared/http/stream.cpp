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

}  // namespace

Stream::Stream(beast::tcp_stream stream, std::unique_ptr<Feed> feed, const Limits& limits,
               Tally& tally)
    : socket_(std::move(stream)), feed_(std::move(feed)), tally_(tally) {
  websocket::stream_base::timeout times{};
  times.handshake_timeout = limits.deadline;
  times.idle_timeout = limits.stream_idle;
  times.keep_alive_pings = true;
  socket_.set_option(times);
  socket_.read_message_max(kMostHeard);
}

void Stream::begin(Upgrade request) {
  request_ = std::move(request);
  beast::get_lowest_layer(socket_).expires_never();  // its own time-outs from here on
  socket_.async_accept(request_, [self = shared_from_this()](Failure failed) {
    if (failed) return;
    self->open_ = true;
    self->listen();
    self->say_next();
  });
}

void Stream::poke() {
  if (poked_.exchange(true)) return;
  asio::post(socket_.get_executor(), [self = shared_from_this()] {
    self->poked_ = false;
    self->say_next();
  });
}

void Stream::listen() {
  socket_.async_read(heard_, [self = shared_from_this()](Failure failed, std::size_t) {
    if (failed) {
      self->open_ = false;
      if (failed == beast::error::timeout || failed == websocket::error::message_too_big ||
          failed == websocket::error::buffer_overflow)
        ++self->tally_.cut_off;
      return;
    }
    const auto bytes = self->heard_.data();
    const bool sound = self->feed_->hear({static_cast<const char*>(bytes.data()), bytes.size()});
    self->heard_.consume(self->heard_.size());
    if (sound) return self->listen();
    self->cut_off();
  });
}

void Stream::say_next() {
  if (!open_ || saying_) return;
  auto next = feed_->next();
  if (!next) return;
  message_ = std::move(*next);
  saying_ = true;
  socket_.binary(message_.binary);
  socket_.async_write(asio::buffer(message_.bytes),
                      [self = shared_from_this()](Failure failed, std::size_t) {
                        self->saying_ = false;
                        if (failed)
                          self->open_ = false;
                        else
                          self->say_next();
                      });
}

void Stream::cut_off() {
  ++tally_.cut_off;
  open_ = false;
  beast::get_lowest_layer(socket_).close();
}

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
