// SPDX-License-Identifier: Apache-2.0
// Bodies, pages of other origins, and WebSockets: slow ones, loud ones, too many.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "http/server.hpp"

namespace crane::http {
namespace {

using namespace std::chrono_literals;

/// A client by hand; it reads only when told to.
class Socket {
 public:
  explicit Socket(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int little = 4096;  // what a slow reader's kernel takes for it
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &little, sizeof little);
    const timeval limit{20, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to), 0);
  }
  ~Socket() { close(socket_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  bool send(const std::string& text) const {
    return ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) == ssize_t(text.size());
  }
  /// So many bytes, fewer at the end of the connection.
  [[nodiscard]] std::string read(std::size_t bytes) const {
    std::string out;
    char some[4096];
    while (out.size() < bytes) {
      const ssize_t n = recv(socket_, some, std::min(sizeof some, bytes - out.size()), 0);
      if (n <= 0) break;
      out.append(some, std::size_t(n));
    }
    return out;
  }
  [[nodiscard]] std::string read_all() const { return read(1U << 30U); }
  [[nodiscard]] std::string read_head() const {
    std::string out;
    while (!out.ends_with("\r\n\r\n")) {
      const std::string one = read(1);
      if (one.empty()) break;
      out += one;
    }
    return out;
  }
  /// The payload of the next message, of all its fragments; pings are passed over.
  [[nodiscard]] std::string read_message() const {
    for (std::string message;;) {
      const std::string head = read(2);
      if (head.size() < 2 || (head[0] & 0x0F) == 8) return "closed";
      std::size_t length = static_cast<unsigned char>(head[1]);
      if (length >= 126) {
        const std::string more = read(length == 126 ? 2 : 8);
        length = 0;
        for (const char c : more) length = length << 8U | static_cast<unsigned char>(c);
      }
      const std::string payload = read(length);
      if ((head[0] & 0x0F) > 2) continue;
      message += payload;
      if ((head[0] & 0x80) != 0) return message;
    }
  }

 private:
  int socket_;
};

std::string upgrade(const std::string& path, const std::string& more = "") {
  return "GET " + path +
         " HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
         "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
         more + "\r\n";
}

/// A frame of a client, masked by zeros.
std::string frame(const std::string& text) {
  std::string out = "\x81";
  if (text.size() < 126) {
    out += static_cast<char>(0x80U | text.size());
  } else {
    out += static_cast<char>(0xFE);
    out += static_cast<char>(text.size() >> 8U);
    out += static_cast<char>(text.size() & 0xFFU);
  }
  return out + std::string(4, '\0') + text;
}

/// The newest number and a lot of padding.
class Numbers final : public Feed {
 public:
  Numbers(const std::atomic<int>& newest, std::size_t padding)
      : newest_(newest), padding_(padding) {}
  std::optional<Message> next() override {
    if (newest_ == said_) return std::nullopt;
    said_ = newest_;
    return Message{std::to_string(said_) + " " + std::string(padding_, 'x'), false};
  }

 private:
  const std::atomic<int>& newest_;
  std::size_t padding_;
  int said_ = 0;
};

/// Says what it heard last.
class Listener final : public Feed {
 public:
  explicit Listener(std::size_t padding) : padding_(padding) {}
  std::optional<Message> next() override { return std::exchange(answer_, std::nullopt); }
  bool hear(std::string_view said) override {
    answer_ = Message{std::string(said) + std::string(padding_, 'x'), false};
    return true;
  }

 private:
  std::size_t padding_;
  std::optional<Message> answer_;
};

class HttpStream : public ::testing::Test {
 protected:
  void serve(Limits limits = {}, std::size_t padding = 0) {
    Router router({}, {});
    router.get("/echo", [](const Request& r) { return Response{200, r.query()}; });
    router.post("/echo", [](const Request& r) { return Response{200, "<" + r.body + ">"}; });
    router.stream("/stream", [this, padding](const Request&) {
      return std::make_unique<Numbers>(newest_, padding);
    });
    router.stream("/echo",
                  [padding](const Request&) { return std::make_unique<Listener>(padding); },
                  {"new.v2", "old.v1"}, {"https://viewer.example"});
    auto server = Server::start("127.0.0.1", 0, std::move(router), limits);
    ASSERT_TRUE(server) << server.error().text();
    server_ = std::move(*server);
  }
  std::string ask(const std::string& request) {
    const Socket s(server_->port());
    s.send(request);
    return s.read_all();
  }
  void say(int number) {
    newest_ = number;
    server_->wake();
  }
  bool eventually(const std::function<bool()>& condition) const {
    for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(20ms);
    return condition();
  }

  std::atomic<int> newest_{1};
  std::unique_ptr<Server> server_;
};

std::string post(const std::string& body, const std::string& more = "") {
  return "POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n" + more +
         "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

TEST_F(HttpStream, TakesABodyUpToItsLimit) {
  Limits limits;
  limits.body_bytes = 100;
  limits.threads = 3;
  serve(limits);
  EXPECT_TRUE(ask(post("hello")).ends_with("\r\n\r\n<hello>"));
  EXPECT_TRUE(ask(post(std::string(101, 'x'))).starts_with("HTTP/1.1 413"));
  EXPECT_TRUE(ask("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1\r\n\r\nx")
                  .starts_with("HTTP/1.1 415"))
      << "what a form of another page can send";
  EXPECT_TRUE(ask("GET /echo?a=1 HTTP/1.1\r\nHost: localhost\r\n\r\n").ends_with("\r\n\r\na=1"));
  EXPECT_TRUE(ask("GET /stream HTTP/1.1\r\nHost: localhost\r\n\r\n").starts_with("HTTP/1.1 426"));
}

TEST_F(HttpStream, RefusesPagesOfOtherOrigins) {
  Limits limits;
  limits.body_bytes = 100;
  serve(limits);
  for (const char* origin : {"http://evil.example", "null", "https://localhost.evil.example",
                             "http://localhost:1", "ftp://localhost"}) {
    const std::string line = std::string("Origin: ") + origin + "\r\n";
    EXPECT_TRUE(ask(post("hello", line)).starts_with("HTTP/1.1 403")) << origin;
    EXPECT_TRUE(ask(upgrade("/stream", line)).starts_with("HTTP/1.1 403")) << origin;
  }
  EXPECT_TRUE(ask(post("hello", "Origin: http://localhost\r\n")).ends_with("<hello>"));
  EXPECT_TRUE(ask(upgrade("/nothing")).starts_with("HTTP/1.1 404"));
}

TEST_F(HttpStream, WhoReadsSlowlyGetsWhatIsNewest) {
  serve({}, 4U << 20U);  // more than both kernels hold
  const Socket slow(server_->port());
  slow.send(upgrade("/stream"));
  ASSERT_TRUE(slow.read_head().starts_with("HTTP/1.1 101"));
  ASSERT_TRUE(eventually([&] { return server_->counts().streams == 1; }));
  std::this_thread::sleep_for(100ms);  // the first is on its way
  for (int i = 2; i <= 500; ++i) say(i);
  EXPECT_TRUE(slow.read_message().starts_with("1 "));
  const std::string second = slow.read_message();
  EXPECT_TRUE(second.starts_with("500 ")) << second.substr(0, 10);
  say(501);
  EXPECT_TRUE(slow.read_message().starts_with("501 "));
}

TEST_F(HttpStream, WhoStallsIsCutOffAndOthersGoOn) {
  Limits limits;
  limits.stream_idle = 400ms;
  serve(limits, 4U << 20U);
  const Socket stalled(server_->port());
  stalled.send(upgrade("/stream"));
  EXPECT_TRUE(eventually([&] { return server_->counts().cut_off == 1; }));
  EXPECT_TRUE(eventually([&] { return server_->counts().streams == 0; }));
  const Socket other(server_->port());
  other.send(upgrade("/stream"));
  ASSERT_TRUE(other.read_head().starts_with("HTTP/1.1 101"));
  EXPECT_TRUE(other.read_message().starts_with("1 "));
}

TEST_F(HttpStream, WhoSaysWhatIsNoPartOfItOrTooMuchIsCutOff) {
  serve();
  std::uint64_t cut = 0;
  for (const std::string& said : {frame("hello"), frame(std::string(60'000, 'x'))}) {
    const Socket loud(server_->port());
    loud.send(upgrade("/stream"));
    ASSERT_TRUE(loud.read_head().starts_with("HTTP/1.1 101"));
    EXPECT_EQ(loud.read_message(), "1 ");
    loud.send(said);
    EXPECT_EQ(loud.read_message(), "closed");
    ++cut;
    EXPECT_TRUE(eventually([&] { return server_->counts().cut_off == cut; })) << said.size();
  }
}

TEST_F(HttpStream, OneTooManyIsRefusedAndNobodyIsClosedForIt) {
  Limits limits;
  limits.streams = 3;
  serve(limits);
  std::vector<std::unique_ptr<Socket>> all;
  for (int i = 0; i < 3; ++i) {
    all.push_back(std::make_unique<Socket>(server_->port()));
    all.back()->send(upgrade("/stream"));
    EXPECT_TRUE(all.back()->read_head().starts_with("HTTP/1.1 101"));
  }
  EXPECT_TRUE(ask(upgrade("/stream")).starts_with("HTTP/1.1 503"));
  for (const auto& one : all) EXPECT_EQ(one->read_message(), "1 ");
  say(2);
  for (const auto& one : all) EXPECT_EQ(one->read_message(), "2 ");
  all.clear();
  EXPECT_TRUE(eventually([&] { return server_->counts().streams == 0; }));
}

TEST_F(HttpStream, SpeaksTheBestSubProtocolThatIsOffered) {
  serve();
  const auto protocol = [&](const std::string& offers) {
    const Socket s(server_->port());
    s.send(upgrade("/echo", offers));
    const std::string head = s.read_head();
    const std::string line = "Sec-WebSocket-Protocol: ";
    const std::size_t at = head.find(line);
    if (!head.starts_with("HTTP/1.1 101")) return head.substr(9, 3);
    return at == std::string::npos
               ? "none"
               : head.substr(at + line.size(), head.find("\r\n", at) - at - line.size());
  };
  EXPECT_EQ(protocol("Sec-WebSocket-Protocol: old.v1\r\n"), "old.v1");
  EXPECT_EQ(protocol("Sec-WebSocket-Protocol: x, old.v1 , new.v2\r\n"), "new.v2");
  EXPECT_EQ(protocol("Sec-WebSocket-Protocol: old.v1\r\nSec-WebSocket-Protocol: new.v2\r\n"),
            "new.v2");
  EXPECT_EQ(protocol("Sec-WebSocket-Protocol: old.v1x\r\n"), "400");
  EXPECT_EQ(protocol(""), "400");
}

TEST_F(HttpStream, APageOfOthersMayUseWhatIsOpenToItAndNothingElse) {
  serve();
  const std::string offer = "Sec-WebSocket-Protocol: new.v2\r\n";
  const auto status = [&](const std::string& path, const std::string& origin) {
    const Socket s(server_->port());
    s.send(upgrade(path, offer + "Origin: " + origin + "\r\n"));
    return s.read_head().substr(9, 3);
  };
  EXPECT_EQ(status("/echo", "https://viewer.example"), "101");
  EXPECT_EQ(status("/echo", "https://viewer.example.evil"), "403");
  EXPECT_EQ(status("/stream", "https://viewer.example"), "403");
  EXPECT_TRUE(ask("GET /echo HTTP/1.1\r\nHost: localhost\r\nOrigin: https://viewer.example\r\n\r\n")
                  .starts_with("HTTP/1.1 403"));
}

TEST_F(HttpStream, WhoTalksAndIsHeardIsAnsweredAtOnceWhoNeverReadsIsCutOff) {
  serve({}, 1000);
  const std::string offer = "Sec-WebSocket-Protocol: new.v2\r\n";
  {
    const Socket polite(server_->port());
    polite.send(upgrade("/echo", offer));
    ASSERT_TRUE(polite.read_head().starts_with("HTTP/1.1 101"));
    polite.send(frame("hello"));
    EXPECT_TRUE(polite.read_message().starts_with("hellox")) << "nobody woke it";
  }
  Limits limits;
  limits.stream_idle = 200ms;
  serve(limits, 4U << 20U);
  const Socket rude(server_->port());
  rude.send(upgrade("/echo", offer));
  EXPECT_TRUE(eventually([&] {
    rude.send(frame("more"));
    return server_->counts().cut_off == 1;
  }));
}

}  // namespace
}  // namespace crane::http
