// SPDX-License-Identifier: Apache-2.0
#include "http/server.hpp"

#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <list>
#include <thread>
#include <utility>
#include <vector>

#include "base/loop_watch.hpp"
#include "http/stream.hpp"

namespace crane::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
using Tcp = asio::ip::tcp;
using Failure = boost::system::error_code;

/// What connections share.
struct House {
  const Router& router;
  const Limits& limits;
  Tally& tally;
  Streams& streams;
};

/// One connection: its request, its answer, its end. Lives as long as an operation of it waits.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Tcp::socket socket, const House& house)
      : stream_(std::move(socket)), buffer_(house.limits.request_bytes), house_(house) {
    parser_.header_limit(static_cast<std::uint32_t>(house.limits.request_bytes));
    parser_.body_limit(house.limits.body_bytes);
    stream_.expires_after(house.limits.deadline);  // for all that follows
  }

  /// Any thread.
  void begin() {
    asio::dispatch(stream_.get_executor(), [self = shared_from_this()] {
      bhttp::async_read(self->stream_, self->buffer_, self->parser_,
                        [self](Failure failed, std::size_t) { self->heard(failed); });
    });
  }
  /// Any thread.
  void close() {
    asio::post(stream_.get_executor(), [self = shared_from_this()] { self->stream_.close(); });
  }

 private:
  Request request() {
    auto& message = parser_.get();
    const auto line = [&](bhttp::field field) { return std::string(message[field]); };
    Request out{std::string(message.method_string()), std::string(message.target()), {}, ""};
    const auto hosts = message.equal_range(bhttp::field::host);
    for (auto host = hosts.first; host != hosts.second; ++host)
      out.hosts.emplace_back(host->value());
    Failure gone;
    out.local_address = stream_.socket().local_endpoint(gone).address().to_string();
    out.origin = line(bhttp::field::origin);
    out.authorization = line(bhttp::field::authorization);
    out.cookie = line(bhttp::field::cookie);
    out.content_type = line(bhttp::field::content_type);
    return out;
  }

  void heard(Failure failed) {
    if (!failed) {
      Request asked = request();
      if (beast::websocket::is_upgrade(parser_.get())) return upgrade(asked);
      asked.body = std::move(parser_.get().body());
      return say(house_.router.answer(asked), parser_.get().method() == bhttp::verb::head);
    }
    if (failed == beast::error::timeout || failed == asio::error::operation_aborted) {
      ++house_.tally.closed;
    } else if (failed == bhttp::error::header_limit || failed == bhttp::error::buffer_overflow) {
      say({431, "the request is too long\n"}, false);
    } else if (failed == bhttp::error::body_limit || failed == bhttp::error::unexpected_body) {
      say({413, house_.limits.body_bytes == 0 ? "a request has no body here\n"
                                              : "the request's body is too long\n"},
          false);
    } else if (failed.category() == make_error_code(bhttp::error::bad_version).category() &&
               failed != bhttp::error::end_of_stream && failed != bhttp::error::partial_message) {
      say({400, "this is no sound HTTP request\n"}, false);
    }
  }

  void upgrade(const Request& asked) {
    auto made = house_.router.upgrade(asked);
    if (made.feed == nullptr) return say(std::move(made.refused), false);
    if (house_.streams.count() >= house_.limits.streams)
      return say({503, "too many look on: close one of the pages\n"}, false);
    Stream::Upgrade request = parser_.release();
    const auto stream = std::make_shared<Stream>(std::move(stream_), std::move(made.feed),
                                                 house_.limits, house_.tally);
    if (house_.streams.add(stream, house_.limits.streams)) stream->begin(std::move(request));
  }

  void say(Response response, bool head) {
    const House& h = house_;
    ++(response.status < 400 || response.status >= 500 ? h.tally.answered : h.tally.refused);
    answer_.result(static_cast<unsigned>(response.status));
    answer_.version(11);
    answer_.keep_alive(false);
    answer_.set(bhttp::field::content_type, response.type);
    answer_.set(bhttp::field::cache_control, "no-store");
    answer_.set("X-Content-Type-Options", "nosniff");
    for (const auto& [name, value] : response.headers) answer_.set(name, value);
    answer_.content_length(response.body.size());
    if (!head) answer_.body() = std::move(response.body);
    if (h.limits.answer_deadline.count() > 0) stream_.expires_after(h.limits.answer_deadline);
    bhttp::async_write(stream_, answer_, [self = shared_from_this()](Failure failed, std::size_t) {
      if (failed == beast::error::timeout) ++self->house_.tally.closed;
      if (!failed) self->part();
    });
  }

  /// Until the other end has closed: a reset would take the answer from whoever still sends.
  void part() {
    Failure gone;
    stream_.socket().shutdown(Tcp::socket::shutdown_send, gone);
    if (house_.limits.answer_deadline.count() > 0) stream_.expires_after(house_.limits.deadline);
    linger();
  }
  void linger() {
    stream_.async_read_some(asio::buffer(rest_),
                            [self = shared_from_this()](Failure failed, std::size_t) {
                              if (!failed) self->linger();
                            });
  }

  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  bhttp::request_parser<bhttp::string_body> parser_;
  bhttp::response<bhttp::string_body> answer_;
  char rest_[1024];
  const House& house_;
};

}  // namespace

struct Server::Impl {
  Impl(Router r, const Limits& l) : router(std::move(r)), limits(l) {}

  Router router;
  Limits limits;
  Tally tally;
  Streams streams;
  House house{router, limits, tally, streams};
  asio::io_context io;
  asio::strand<asio::io_context::executor_type> door{io.get_executor()};  ///< who comes in
  Tcp::acceptor acceptor{door};
  asio::steady_timer pause{door};
  std::list<std::weak_ptr<Session>> sessions;  ///< the oldest first
  int port = 0;
  std::vector<std::thread> threads;

  void listen(const std::string& address, int wanted) {
    const auto found =
        Tcp::resolver(io).resolve(address, std::to_string(wanted), Tcp::resolver::passive);
    const Tcp::endpoint at = found.begin()->endpoint();
    acceptor.open(at.protocol());
    acceptor.set_option(Tcp::acceptor::reuse_address(true));
    acceptor.bind(at);
    acceptor.listen();
    port = acceptor.local_endpoint().port();
  }

  void make_room(std::size_t most) {
    sessions.remove_if([](const auto& session) { return session.expired(); });
    for (; sessions.size() > most; sessions.pop_front())
      if (const auto oldest = sessions.front().lock()) oldest->close();
  }

  void accept() {
    acceptor.async_accept(asio::make_strand(io), [this](Failure failed, auto accepted) {
      if (failed == asio::error::operation_aborted) return;
      if (failed) {  // no descriptors left: those of who waits longest
        make_room(sessions.size() / 2);
        pause.expires_after(std::chrono::milliseconds(20));
        return pause.async_wait([this](Failure) { accept(); });
      }
      make_room(limits.connections - 1);
      const auto session = std::make_shared<Session>(Tcp::socket(std::move(accepted)), house);
      sessions.push_back(session);
      session->begin();
      accept();
    });
  }

  /// An accept may be waiting already: it is given up for this one.
  void accept_again() {
    Failure gone;
    acceptor.cancel(gone);
    accept();
  }

  void run() {
    name_thread("http");
    while (!io.stopped()) {
      try {
        io.run();
      } catch (const std::exception&) {  // out of memory: that connection is gone, others go on
        if (!io.stopped()) asio::post(door, [this] { accept_again(); });
      }
    }
  }
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() {
  impl_->io.stop();
  for (std::thread& thread : impl_->threads) thread.join();
}

Result<std::unique_ptr<Server>> Server::start(const std::string& address, int port, Router router,
                                              const Limits& limits) {
  auto impl = std::make_unique<Impl>(std::move(router), limits);
  try {
    impl->listen(address, port);
  } catch (const std::exception& e) {
    return Error{ErrorCode::kResource, "http " + address + ":" + std::to_string(port),
                 "cannot be listened at: " + std::string(e.what()),
                 "give http.address and http.port what is free, or port 0"};
  }
  impl->accept();
  auto server = std::unique_ptr<Server>(new Server(std::move(impl)));
  for (int i = 0; i < limits.threads; ++i)
    server->impl_->threads.emplace_back([raw = server->impl_.get()] { raw->run(); });
  return server;
}

int Server::port() const {
  return impl_->port;
}

void Server::wake() {
  impl_->streams.poke();
}

Server::Counts Server::counts() const {
  const Tally& t = impl_->tally;
  return {t.answered, t.refused, t.closed, impl_->streams.count(), t.cut_off};
}

}  // namespace crane::http
