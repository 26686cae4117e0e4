// SPDX-License-Identifier: Apache-2.0
#include "http/server.hpp"

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <list>
#include <thread>
#include <utility>

#include "base/loop_watch.hpp"

namespace crane::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
using Tcp = asio::ip::tcp;
using Failure = boost::system::error_code;

struct Tally {
  std::atomic<std::uint64_t> answered{0}, refused{0}, closed{0};
};

/// One connection: its request, its answer, its end. Lives as long as an operation of it waits.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Tcp::socket socket, const Router& router, const Limits& limits, Tally& tally)
      : stream_(std::move(socket)), buffer_(limits.request_bytes), router_(router), tally_(tally) {
    parser_.header_limit(static_cast<std::uint32_t>(limits.request_bytes));
    parser_.body_limit(0);
    stream_.expires_after(limits.deadline);  // once, for all that follows
  }

  void begin() {
    bhttp::async_read(
        stream_, buffer_, parser_,
        [self = shared_from_this()](Failure failed, std::size_t) { self->heard(failed); });
  }
  void close() { stream_.close(); }

 private:
  void heard(Failure failed) {
    if (!failed) {
      const auto& message = parser_.get();
      Request request{std::string(message.method_string()), std::string(message.target()), {}, ""};
      const auto hosts = message.equal_range(bhttp::field::host);
      for (auto host = hosts.first; host != hosts.second; ++host)
        request.hosts.emplace_back(host->value());
      Failure gone;
      request.local_address = stream_.socket().local_endpoint(gone).address().to_string();
      return say(router_.answer(request), message.method() == bhttp::verb::head);
    }
    if (failed == beast::error::timeout || failed == asio::error::operation_aborted) {
      ++tally_.closed;
    } else if (failed == bhttp::error::header_limit || failed == bhttp::error::buffer_overflow) {
      say({431, "the request is too long\n"}, false);
    } else if (failed == bhttp::error::body_limit || failed == bhttp::error::unexpected_body) {
      say({413, "a request has no body here\n"}, false);
    } else if (failed.category() == make_error_code(bhttp::error::bad_version).category() &&
               failed != bhttp::error::end_of_stream && failed != bhttp::error::partial_message) {
      say({400, "this is no sound HTTP request\n"}, false);
    }
  }

  void say(Response response, bool head) {
    ++(response.status < 400 || response.status >= 500 ? tally_.answered : tally_.refused);
    answer_.result(static_cast<unsigned>(response.status));
    answer_.version(11);
    answer_.keep_alive(false);
    answer_.set(bhttp::field::content_type, response.type);
    answer_.set(bhttp::field::cache_control, "no-store");
    answer_.set("X-Content-Type-Options", "nosniff");
    answer_.content_length(response.body.size());
    if (!head) answer_.body() = std::move(response.body);
    bhttp::async_write(stream_, answer_, [self = shared_from_this()](Failure failed, std::size_t) {
      if (failed == beast::error::timeout) ++self->tally_.closed;
      if (!failed) self->part();
    });
  }

  /// Until the other end has closed: a reset would take the answer from whoever still sends.
  void part() {
    Failure gone;
    stream_.socket().shutdown(Tcp::socket::shutdown_send, gone);
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
  bhttp::request_parser<bhttp::empty_body> parser_;
  bhttp::response<bhttp::string_body> answer_;
  char rest_[1024];
  const Router& router_;
  Tally& tally_;
};

}  // namespace

struct Server::Impl {
  Impl(Router r, const Limits& l) : router(std::move(r)), limits(l) {}

  Router router;
  Limits limits;
  Tally tally;
  asio::io_context io{1};
  Tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};
  std::list<std::weak_ptr<Session>> sessions;  ///< the oldest first
  int port = 0;
  std::thread thread;

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
    acceptor.async_accept([this](Failure failed, Tcp::socket socket) {
      if (failed == asio::error::operation_aborted) return;
      if (failed) {  // no descriptors left: those of who waits longest
        make_room(sessions.size() / 2);
        pause.expires_after(std::chrono::milliseconds(20));
        return pause.async_wait([this](Failure) { accept(); });
      }
      make_room(limits.connections - 1);
      const auto session = std::make_shared<Session>(std::move(socket), router, limits, tally);
      sessions.push_back(session);
      session->begin();
      accept();
    });
  }

  void run() {
    name_thread("http");
    while (!io.stopped()) {
      try {
        io.run();
      } catch (const std::exception&) {  // out of memory: that connection is gone, others go on
        if (acceptor.is_open() && !io.stopped()) accept();
      }
    }
  }
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() {
  impl_->io.stop();
  if (impl_->thread.joinable()) impl_->thread.join();
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
  impl->thread = std::thread([raw = impl.get()] { raw->run(); });
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

int Server::port() const {
  return impl_->port;
}

Server::Counts Server::counts() const {
  return {impl_->tally.answered, impl_->tally.refused, impl_->tally.closed};
}

}  // namespace crane::http
