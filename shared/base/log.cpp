#include "base/log.hpp"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <mutex>

namespace crane {
namespace {

std::mutex& log_mutex() {
  static std::mutex mutex;
  return mutex;
}

std::string& log_name() {
  static std::string name = "cranemap";
  return name;
}

}  // namespace

void set_log_name(const std::string& name) {
  const std::lock_guard lock(log_mutex());
  log_name() = name;
}

void log(LogLevel level, const std::string& text) {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch());
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char stamp[32];
  std::strftime(stamp, sizeof stamp, "%H:%M:%S", &utc);
  constexpr const char* kNames[] = {"INFO", "WARN", "ERROR"};
  const std::lock_guard lock(log_mutex());
  std::fprintf(stderr, "%s.%03d %-5s %s: %s\n", stamp, static_cast<int>(ms.count() % 1000),
               kNames[static_cast<int>(level)], log_name().c_str(), text.c_str());
}

}  // namespace crane
