// SPDX-License-Identifier: Apache-2.0
#include "http/client.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

namespace crane::http {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace bhttp = boost::beast::http;
using Failure = boost::system::error_code;

constexpr std::uint64_t kMostBytes = 4U << 20U;

}  // namespace

Result<Response> get(const std::string& address, int port, const std::string& path,
                     std::chrono::milliseconds limit) {
  const Error none{ErrorCode::kNotAvailable, "http " + address + ":" + std::to_string(port),
                   "no answer", "is the service running?"};
  try {
    asio::io_context io(1);
    const auto at = asio::ip::tcp::resolver(io).resolve(address, std::to_string(port));
    beast::tcp_stream stream(io);
    beast::flat_buffer buffer;
    bhttp::request<bhttp::empty_body> request(bhttp::verb::get, path, 11);
    request.set(bhttp::field::host,
                address.find(':') == std::string::npos ? address : "[" + address + "]");
    bhttp::response_parser<bhttp::string_body> answer;
    answer.body_limit(kMostBytes);
    Failure outcome = asio::error::would_block;
    stream.expires_after(limit);
    stream.async_connect(at, [&](Failure failed, const auto&) {
      if (failed) return void(outcome = failed);
      bhttp::async_write(stream, request, [&](Failure unsent, std::size_t) {
        if (unsent) return void(outcome = unsent);
        bhttp::async_read(stream, buffer, answer,
                          [&](Failure unread, std::size_t) { outcome = unread; });
      });
    });
    io.run();
    if (outcome) return none;
    return Response{static_cast<int>(answer.get().result_int()), answer.get().body(),
                    std::string(answer.get()[bhttp::field::content_type])};
  } catch (const std::exception&) {  // no such address
    return none;
  }
}

}  // namespace crane::http
