// SPDX-License-Identifier: Apache-2.0
#include "http/session.hpp"

#include <openssl/err.h>
#include <openssl/sslerr.h>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <type_traits>
#include <utility>

namespace crane::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
using Tcp = asio::ip::tcp;
using Failure = boost::system::error_code;

constexpr char kSpeakTls[] =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n"
    "\r\nthis port speaks TLS: ask by https:// or wss://\n";

template <class Socket>
class SessionOn : public Session, public std::enable_shared_from_this<SessionOn<Socket>> {
 public:
  SessionOn(Socket socket, const House& house)
      : stream_(std::move(socket)), buffer_(house.limits.request_bytes), house_(house) {
    parser_.header_limit(static_cast<std::uint32_t>(house.limits.request_bytes));
    parser_.body_limit(house.limits.body_bytes);
    tcp().expires_after(house.limits.deadline);  // for all that follows
  }

  void begin() override {
    asio::dispatch(stream_.get_executor(), [self = this->shared_from_this()] {
      if constexpr (kSecure)
        self->stream_.async_handshake(asio::ssl::stream_base::server,
                                      [self](Failure failed) { self->shaken(failed); });
      else
        self->read();
    });
  }
  void close() override {
    asio::post(stream_.get_executor(), [self = this->shared_from_this()] { self->tcp().close(); });
  }

 private:
  static constexpr bool kSecure = std::is_same_v<Socket, SecureSocket>;
  beast::tcp_stream& tcp() { return beast::get_lowest_layer(stream_); }

  void read() {
    bhttp::async_read(
        stream_, buffer_, parser_,
        [self = this->shared_from_this()](Failure failed, std::size_t) { self->heard(failed); });
  }

  void shaken(Failure failed) {
    if (!failed) return read();
    if (failed == beast::error::timeout || failed == asio::error::operation_aborted)
      return void(++house_.tally.closed);
    ++house_.tally.refused;
    // Whoever spoke in the clear understands this; what they said is not answered.
    if (failed.category() == asio::error::get_ssl_category() &&
        ERR_GET_REASON(static_cast<unsigned long>(failed.value())) == SSL_R_HTTP_REQUEST)
      asio::async_write(tcp(), asio::buffer(kSpeakTls, sizeof kSpeakTls - 1),
                        [self = this->shared_from_this()](Failure unsent, std::size_t) {
                          if (!unsent) self->end();
                        });
  }

  Request request() {
    auto& message = parser_.get();
    const auto line = [&](bhttp::field field) { return std::string(message[field]); };
    Request out{std::string(message.method_string()), std::string(message.target()), {}, ""};
    const auto hosts = message.equal_range(bhttp::field::host);
    for (auto host = hosts.first; host != hosts.second; ++host)
      out.hosts.emplace_back(host->value());
    Failure gone;
    out.local_address = tcp().socket().local_endpoint(gone).address().to_string();
    out.origin = line(bhttp::field::origin);
    out.authorization = line(bhttp::field::authorization);
    out.cookie = line(bhttp::field::cookie);
    out.content_type = line(bhttp::field::content_type);
    out.secure = kSecure;
    out.upgrade = beast::websocket::is_upgrade(message);
    const auto offers = message.equal_range(bhttp::field::sec_websocket_protocol);
    for (auto offer = offers.first; offer != offers.second; ++offer)
      for (const auto& protocol : bhttp::token_list(offer->value()))
        out.protocols.emplace_back(protocol);
    return out;
  }

  void heard(Failure failed) {
    if (!failed) {
      Request asked = request();
      if (asked.upgrade) return upgrade(asked);
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
    typename StreamOn<Socket>::Upgrade request = parser_.release();
    const auto stream = std::make_shared<StreamOn<Socket>>(
        std::move(stream_), std::move(made.feed), made.protocol, house_.limits, house_.tally);
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
    if (h.limits.answer_deadline.count() > 0) tcp().expires_after(h.limits.answer_deadline);
    bhttp::async_write(stream_, answer_,
                       [self = this->shared_from_this()](Failure failed, std::size_t) {
                         if (failed == beast::error::timeout) ++self->house_.tally.closed;
                         if (!failed) self->part();
                       });
  }

  void part() {
    if (house_.limits.answer_deadline.count() > 0) tcp().expires_after(house_.limits.deadline);
    if constexpr (kSecure)
      stream_.async_shutdown([self = this->shared_from_this()](Failure) { self->end(); });
    else
      end();
  }
  /// Until the other end has closed: a reset would take the answer from whoever still sends.
  void end() {
    Failure gone;
    tcp().socket().shutdown(Tcp::socket::shutdown_send, gone);
    linger();
  }
  void linger() {
    tcp().async_read_some(asio::buffer(rest_),
                          [self = this->shared_from_this()](Failure failed, std::size_t) {
                            if (!failed) self->linger();
                          });
  }

  Socket stream_;
  beast::flat_buffer buffer_;
  bhttp::request_parser<bhttp::string_body> parser_;
  bhttp::response<bhttp::string_body> answer_;
  char rest_[1024];
  const House& house_;
};

}  // namespace

std::shared_ptr<Session> Session::make(Tcp::socket socket, const House& house) {
  if (house.tls == nullptr)
    return std::make_shared<SessionOn<PlainSocket>>(PlainSocket(std::move(socket)), house);
  return std::make_shared<SessionOn<SecureSocket>>(SecureSocket(std::move(socket), *house.tls),
                                                   house);
}

}  // namespace crane::http
