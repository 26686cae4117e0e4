#include "service/health.hpp"

#include <httplib.h>

#include <chrono>
#include <exception>
#include <mutex>
#include <thread>

namespace crane {
namespace {

using Steady = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kSilent = 30s;
constexpr int kUnavailable = 503;

}  // namespace

struct HealthServer::Impl {
  std::mutex mutex;
  Word word;
  Steady::time_point told = Steady::now();
  httplib::Server server;
  std::thread thread;

  void answer(bool Word::*good, httplib::Response& response) {
    const std::lock_guard lock(mutex);
    const bool silent = Steady::now() - told > kSilent;
    if (silent || !(word.*good)) response.status = kUnavailable;
    response.set_content(silent ? "hangs: nothing done for 30 s\n" : word.text + "\n",
                         "text/plain");
  }
};

HealthServer::HealthServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

HealthServer::~HealthServer() {
  impl_->server.stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

Result<std::unique_ptr<HealthServer>> HealthServer::start(const std::string& address, int port) {
  auto impl = std::make_unique<Impl>();
  httplib::Server& s = impl->server;
  s.Get("/metrics", [raw = impl.get()](const httplib::Request&, httplib::Response& response) {
    const std::lock_guard lock(raw->mutex);
    response.set_content(raw->word.metrics, "text/plain; version=0.0.4");
  });
  s.Get("/healthz", [raw = impl.get()](const httplib::Request&, httplib::Response& response) {
    raw->answer(&Word::healthy, response);
  });
  s.Get("/readyz", [raw = impl.get()](const httplib::Request&, httplib::Response& response) {
    raw->answer(&Word::ready, response);
  });
  // Whoever holds a connection open, or sends much, is cut off; two at a time are served.
  s.new_task_queue = [] { return new httplib::ThreadPool(2); };
  s.set_read_timeout(1);
  s.set_write_timeout(1);
  s.set_keep_alive_max_count(1);
  s.set_payload_max_length(1024);
  // Not SO_REUSEPORT, the library's default: two services would then share one port.
  s.set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  if (!s.bind_to_port(address, port))
    return Error{ErrorCode::kResource, "http " + address + ":" + std::to_string(port),
                 "cannot be listened at",
                 "give http.address and http.port what is free, or port 0"};
  impl->thread = std::thread([raw = impl.get()] {
    try {
      raw->server.listen_after_bind();
    } catch (const std::exception&) {  // the service goes on without answers over HTTP
    }
  });
  for (int i = 0; i < 200 && !s.is_running(); ++i) std::this_thread::sleep_for(5ms);
  return std::unique_ptr<HealthServer>(new HealthServer(std::move(impl)));
}

void HealthServer::tell(Word word) {
  const std::lock_guard lock(impl_->mutex);
  impl_->word = std::move(word);
  impl_->told = Steady::now();
}

Result<void> ask_health(const std::string& address, int port) {
  const bool any = address == "0.0.0.0";
  httplib::Client client(any ? "127.0.0.1" : address, port);
  client.set_connection_timeout(2);
  client.set_read_timeout(2);
  const auto answer = client.Get("/healthz");
  const std::string where = "http " + address + ":" + std::to_string(port);
  if (!answer)
    return Error{ErrorCode::kNotAvailable, where, "no answer", "is the service running?"};
  if (answer->status != 200) return Error{ErrorCode::kResource, where, answer->body, ""};
  return {};
}

}  // namespace crane
