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
#include "http/session.hpp"
#include "http/tls_context.hpp"

namespace crane::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
using Tcp = asio::ip::tcp;
using Failure = boost::system::error_code;

}  // namespace

struct Server::Impl {
  Impl(Router r, const Limits& l, std::unique_ptr<asio::ssl::context> t)
      : router(std::move(r)), limits(l), tls(std::move(t)) {}

  Router router;
  Limits limits;
  Tally tally;
  Streams streams;
  std::unique_ptr<asio::ssl::context> tls;
  House house{router, limits, tally, streams, tls.get()};
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
      const auto session = Session::make(Tcp::socket(std::move(accepted)), house);
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
                                              const Limits& limits,
                                              const std::optional<TlsFiles>& tls) {
  std::unique_ptr<asio::ssl::context> context;
  if (tls) {
    auto made = make_tls_context(*tls);
    if (!made) return made.error();
    context = std::move(*made);
  }
  auto impl = std::make_unique<Impl>(std::move(router), limits, std::move(context));
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
