#include "base/log.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <mutex>
#include <nlohmann/json.hpp>

#include "base/utf8.hpp"

namespace crane {
namespace {

constexpr const char* kNames[] = {"INFO", "WARN", "ERROR"};

/// A bucket that fills with time; each line takes one drop.
struct Allowance {
  static constexpr double kMost = 300, kPerSecond = 30;
  double left = kMost;
  std::chrono::steady_clock::time_point at = std::chrono::steady_clock::now();
  std::uint64_t left_out = 0;

  bool take() {
    const auto now = std::chrono::steady_clock::now();
    left = std::min(kMost, left + kPerSecond * std::chrono::duration<double>(now - at).count());
    at = now;
    if (left < 1) {
      ++left_out;
      return false;
    }
    left -= 1;
    return true;
  }
};

struct Log {
  std::mutex mutex;
  std::string name = "cranemap";
  LogFormat format = LogFormat::kText;
  Allowance allowance;

  void print(LogLevel level, const std::string& text) const {
    const auto now = std::chrono::system_clock::now();
    const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch());
    const int fraction = static_cast<int>(ms.count() % 1000);
    std::tm utc{};
    gmtime_r(&seconds, &utc);
    char stamp[32];
    const char* level_name = kNames[static_cast<int>(level)];
    if (format == LogFormat::kJson) {
      std::strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
      char time[48];
      std::snprintf(time, sizeof time, "%s.%03dZ", stamp, fraction);
      const nlohmann::ordered_json line = {{"time", time},
                                           {"level", level_name},
                                           {"service", with_bytes_escaped(name)},
                                           {"text", with_bytes_escaped(text)}};
      std::fprintf(stderr, "%s\n", line.dump().c_str());
    } else {
      std::strftime(stamp, sizeof stamp, "%H:%M:%S", &utc);
      std::fprintf(stderr, "%s.%03d %-5s %s: %s\n", stamp, fraction, level_name, name.c_str(),
                   text.c_str());
    }
  }
};

Log& the_log() {
  static Log log;
  return log;
}

}  // namespace

void set_log_name(const std::string& name) {
  const std::lock_guard lock(the_log().mutex);
  the_log().name = name;
}

void set_log_format(LogFormat format) {
  const std::lock_guard lock(the_log().mutex);
  the_log().format = format;
}

void log(LogLevel level, const std::string& text) {
  Log& l = the_log();
  const std::lock_guard lock(l.mutex);
  if (!l.allowance.take()) return;
  if (l.allowance.left_out > 0)
    l.print(LogLevel::kWarning,
            std::to_string(l.allowance.left_out) + " lines left out: more than 30 a second");
  l.allowance.left_out = 0;
  l.print(level, text);
}

}  // namespace crane
