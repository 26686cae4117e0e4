// SPDX-License-Identifier: Apache-2.0
#include "service/health.hpp"

#include <mutex>
#include <utility>

#include "http/client.hpp"
#include "service/metrics.hpp"

namespace crane {

struct HealthServer::Impl {
  explicit Impl(const LoopWatch& p) : watch(p) {}

  const LoopWatch& watch;
  std::mutex mutex;
  Word word;
  std::unique_ptr<http::Server> server;

  http::Response answer(bool Word::*good) {
    const std::string hangs = watch.trouble();
    const std::lock_guard lock(mutex);
    const bool well = hangs.empty() && word.*good;
    return {well ? 200 : 503, (hangs.empty() ? word.text : hangs) + "\n"};
  }
  http::Response metrics() {
    const bool turn = watch.stalled().empty();
    const std::lock_guard lock(mutex);
    const Gauge healthy{"healthy",
                        "1 while each thread of the service turns and nothing failed.",
                        turn && word.healthy ? 1.0 : 0.0,
                        {}};
    return {200, word.metrics + to_metric(word.crane, word.service, healthy),
            "text/plain; version=0.0.4"};
  }
};

HealthServer::HealthServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
HealthServer::~HealthServer() = default;

Result<std::unique_ptr<HealthServer>> HealthServer::start(const std::string& address, int port,
                                                          const std::vector<std::string>& hosts,
                                                          const LoopWatch& watch) {
  auto impl = std::make_unique<Impl>(watch);
  Impl* raw = impl.get();
  auto server =
      http::Server::start(address, port,
                          http::Router({{"/metrics", [raw] { return raw->metrics(); }},
                                        {"/healthz", [raw] { return raw->answer(&Word::healthy); }},
                                        {"/readyz", [raw] { return raw->answer(&Word::ready); }}},
                                       hosts));
  if (!server) return server.error();
  impl->server = std::move(*server);
  return std::unique_ptr<HealthServer>(new HealthServer(std::move(impl)));
}

void HealthServer::tell(Word word) {
  const std::lock_guard lock(impl_->mutex);
  impl_->word = std::move(word);
}

int HealthServer::port() const {
  return impl_->server->port();
}

http::Server::Counts HealthServer::counts() const {
  return impl_->server->counts();
}

Result<void> ask_health(const std::string& address, int port) {
  const std::string at = address == "0.0.0.0" ? "127.0.0.1" : address == "::" ? "::1" : address;
  const auto answer = http::get(at, port, "/healthz");
  if (!answer) return answer.error();
  if (answer->status != 200)
    return Error{ErrorCode::kResource, "http " + address + ":" + std::to_string(port), answer->body,
                 ""};
  return {};
}

}  // namespace crane
