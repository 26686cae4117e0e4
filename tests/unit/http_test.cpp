// SPDX-License-Identifier: Apache-2.0
// What anybody can do to the HTTP port of a service.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "http/client.hpp"
#include "http/host_check.hpp"
#include "http/server.hpp"

namespace crane::http {
namespace {

using namespace std::chrono_literals;

/// A connection to a port of this host, by hand.
class Connection {
 public:
  explicit Connection(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
  }
  ~Connection() { close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  [[nodiscard]] bool connected() const { return connected_; }
  /// False once the other end is gone.
  bool send(const std::string& text) const {
    return ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) == ssize_t(text.size());
  }
  /// All until the other end closes; nothing when it has not within the limit.
  [[nodiscard]] std::optional<std::string> rest(std::chrono::milliseconds limit = 20s) const {
    std::string all;
    const auto end = std::chrono::steady_clock::now() + limit;
    while (std::chrono::steady_clock::now() < end) {
      pollfd wait{socket_, POLLIN, 0};
      if (poll(&wait, 1, 100) != 1) continue;
      char bytes[4096];
      const ssize_t n = recv(socket_, bytes, sizeof bytes, 0);
      if (n <= 0) return all;
      all.append(bytes, static_cast<std::size_t>(n));
    }
    return std::nullopt;
  }

 private:
  int socket_;
  bool connected_ = false;
};

constexpr const char* kMetrics = "0123456789 all of it\n";

std::unique_ptr<Server> serve(const Limits& limits = {}) {
  auto server = Server::start("127.0.0.1", 0,
                              Router({{"/metrics",
                                       [] {
                                         return Response{200, kMetrics};
                                       }},
                                      {"/large",
                                       [] {
                                         return Response{200, std::string(64U << 20U, 'x')};
                                       }},
                                      {"/throws", []() -> Response { throw std::bad_alloc(); }}},
                                     {"crane7.plant.example"}),
                              limits);
  EXPECT_TRUE(server) << server.error().text();
  return std::move(*server);
}

std::string ask(const Server& server, const std::string& request) {
  const Connection c(server.port());
  EXPECT_TRUE(c.send(request));
  return c.rest().value_or("not closed");
}

std::string with_host(const std::string& host) {
  return "GET /metrics HTTP/1.1\r\nHost: " + host + "\r\n\r\n";
}

TEST(HttpServer, AnswersARouteWholeAndClosesTheConnection) {
  const auto server = serve();
  for (const char* request :
       {"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n", "GET /metrics?a=b HTTP/1.0\r\n\r\n",
        "GET /metrics HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-1,0-1,0-1\r\n\r\n",
        "GET /metrics HTTP/1.1\r\n\r\nGET /metrics HTTP/1.1\r\n\r\n"}) {
    const std::string answer = ask(*server, request);
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 ")) << request << answer;
    EXPECT_TRUE(answer.ends_with(std::string("\r\n\r\n") + kMetrics)) << request << answer;
  }
  const std::string head = ask(*server, "HEAD /metrics HTTP/1.1\r\n\r\n");
  EXPECT_NE(head.find("Content-Length: 21\r\n"), std::string::npos) << head;
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << head;
  const auto got = get("127.0.0.1", server->port(), "/metrics");
  ASSERT_TRUE(got) << got.error().text();
  EXPECT_EQ(got->body, kMetrics);
  EXPECT_EQ(server->counts().refused, 0U);
}

TEST(HttpServer, RefusesWhatIsNoSoundRequestForItAndCountsIt) {
  const auto server = serve();
  const std::pair<std::string, std::string> cases[] = {
      {with_host("evil.example"), "403"},
      {with_host("localhost.evil.example:9464"), "403"},
      {with_host("127.0.0.1.evil.example"), "403"},
      {with_host("10.0.0.1"), "403"},
      {with_host("localhost\r\nHost: evil.example"), "400"},
      {"GET http://evil.example/metrics HTTP/1.1\r\n\r\n", "400"},
      {"POST /metrics HTTP/1.1\r\nContent-Length: 0\r\n\r\n", "405"},
      {"GET /metrics HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello", "413"},
      {"GET /metrics HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n", "413"},
      {"GET /metrics HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n", "413"},
      {"GET /nothing HTTP/1.1\r\n\r\n", "404"},
      {"GET /metrics HTTP/1.1\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n", "431"},
      {"GET /" + std::string(20'000, 'x') + " HTTP/1.1\r\n\r\n", "431"},
      {std::string("\x16\x03\x01\0\0 no HTTP\r\n\r\n", 17), "400"},
      {"GET /metrics HTTP/7.1\r\n\r\n", "400"}};
  for (const auto& [request, status] : cases) {
    const std::string answer = ask(*server, request);
    EXPECT_TRUE(answer.starts_with("HTTP/1.1 " + status)) << request.substr(0, 80) << "\n"
                                                          << answer;
  }
  EXPECT_EQ(server->counts().refused, std::size(cases));
  EXPECT_TRUE(ask(*server, "GET /throws HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 500"));
  EXPECT_TRUE(get("127.0.0.1", server->port(), "/metrics")) << "and goes on";
}

TEST(HttpServer, WhoHoldsConnectionsOpenKeepsNobodyOut) {
  const auto server = serve({60s, 8});
  std::vector<std::unique_ptr<Connection>> slow;
  for (int i = 0; i < 40; ++i) {
    slow.push_back(std::make_unique<Connection>(server->port()));
    ASSERT_TRUE(slow.back()->connected());
    slow.back()->send("GET /metrics HTTP/1.1\r\nX: 1\r\n");
    if (i % 8 == 7) EXPECT_TRUE(get("127.0.0.1", server->port(), "/metrics", 20s)) << i;
  }
  for (int i = 0; i < 30; ++i) EXPECT_TRUE(slow[i]->rest()) << "the oldest is closed: " << i;
  EXPECT_GE(server->counts().closed, 30U);
}

TEST(HttpServer, ARequestOrAnswerThatTricklesIsCutOffAtItsDeadline) {
  const auto server = serve({300ms, 8});
  const Connection slow(server->port());
  slow.send("GET /metrics HTTP/1.1\r\n");
  bool open = true;  // a line at a time never ends the request, and does not move the deadline
  for (int i = 0; open && i < 1000; ++i) {
    open = slow.send("X: 1\r\n");
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_FALSE(open);
  const Connection deaf(server->port());  // asks for much and reads nothing
  deaf.send("GET /large HTTP/1.1\r\n\r\n");
  for (int i = 0; i < 1000 && server->counts().closed < 2; ++i) std::this_thread::sleep_for(20ms);
  EXPECT_EQ(server->counts().closed, 2U);
}

TEST(HttpServer, EndsAtOnceWhoeverIsConnected) {
  auto server = serve({1h, 64});
  std::vector<std::unique_ptr<Connection>> open;
  for (int i = 0; i < 30; ++i) {
    open.push_back(std::make_unique<Connection>(server->port()));
    open.back()->send(i % 2 == 0 ? "GET /metrics HT" : "GET /large HTTP/1.1\r\n\r\n");
  }
  server.reset();  // an hour otherwise
  for (const auto& c : open) EXPECT_TRUE(c->rest());
}

TEST(HostCheck, KnowsItsOwnNamesOnly) {
  const std::vector<std::string> names = {"Mapper", "crane7.plant.example"};
  for (const char* own :
       {"localhost", "LOCALHOST:9464", "localhost.", "127.0.0.1", "127.9.9.9:1", "[::1]",
        "[::1]:9464", "10.1.2.3:80", "mapper:9464", "Crane7.Plant.Example."})
    EXPECT_TRUE(is_own_host(own, "10.1.2.3", names)) << own;
  for (const char* other : {"",
                            ":9464",
                            ".",
                            "evil.example",
                            "localhost.evil.example",
                            "127.0.0.1.nip.io",
                            "10.1.2.4",
                            "[::2]",
                            "[::1",
                            "[::1]x",
                            "[::1]:x",
                            "127.0.0.1:x",
                            "127.0.0.1:999999",
                            "mapper.evil.example",
                            "localhost:1:2",
                            "::1",
                            "2130706433",
                            "0x7f.0.0.1",
                            "user@localhost",
                            " localhost"})
    EXPECT_FALSE(is_own_host(other, "10.1.2.3", names)) << other;
  EXPECT_TRUE(is_own_host("10.1.2.3", "::ffff:10.1.2.3", {}));
  EXPECT_FALSE(is_own_host("", "", {""}));
}

}  // namespace
}  // namespace crane::http
