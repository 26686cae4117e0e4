// SPDX-License-Identifier: Apache-2.0
#include "base/log.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/expects.hpp"
#include "base/line_writer.hpp"
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

constexpr std::size_t kMostUnread = 1000;
constexpr std::chrono::milliseconds kAtExit{300};  ///< whoever does not read then does not want to

class Log {
 public:
  Log()
      : writer_(STDERR_FILENO, kMostUnread, [this](std::uint64_t count) {
          return line(LogLevel::kWarning,
                      std::to_string(count) + " lines left out: nobody read the log");
        }) {}

  void name(const std::string& name) {
    const std::lock_guard lock(mutex_);
    name_ = name;
  }
  void format(LogFormat format) { format_ = format; }

  void say(LogLevel level, const std::string& text) {
    {
      const std::lock_guard lock(mutex_);
      if (!allowance_.take()) return;
      const std::uint64_t left_out = std::exchange(allowance_.left_out, 0);
      flooded_ += left_out;
      if (left_out > 0)
        writer_.put(line(LogLevel::kWarning,
                         std::to_string(left_out) + " lines left out: more than 30 a second"));
    }
    writer_.put(line(level, text));
  }

  void put(std::string line) { writer_.put(std::move(line)); }
  bool flush(std::chrono::milliseconds limit) { return writer_.flush(limit); }
  [[nodiscard]] std::uint64_t left_out() const { return flooded_ + writer_.left_out(); }

 private:
  [[nodiscard]] std::string line(LogLevel level, const std::string& text) const;

  std::mutex mutex_;
  std::string name_ = "cranemap";  ///< set before there are threads
  std::atomic<LogFormat> format_ = LogFormat::kText;
  Allowance allowance_;
  std::atomic<std::uint64_t> flooded_{0};
  LineWriter writer_;
};

std::string Log::line(LogLevel level, const std::string& text) const {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch());
  const int fraction = static_cast<int>(ms.count() % 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char stamp[32];
  const char* level_name = kNames[static_cast<int>(level)];
  if (format_ == LogFormat::kJson) {
    std::strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
    char time[48];
    std::snprintf(time, sizeof time, "%s.%03dZ", stamp, fraction);
    const nlohmann::ordered_json entry = {{"time", time},
                                          {"level", level_name},
                                          {"service", with_bytes_escaped(name_)},
                                          {"text", with_bytes_escaped(text)}};
    return entry.dump() + "\n";
  }
  std::strftime(stamp, sizeof stamp, "%H:%M:%S", &utc);
  char head[96];
  std::snprintf(head, sizeof head, "%s.%03d %-5s ", stamp, fraction, level_name);
  return head + name_ + ": " + text + "\n";
}

Log& the_log();

/// Never destroyed: threads of Fast DDS may have something to say until the very end.
Log& the_log() {
  static Log* const kOne = [] {
    auto* log = new Log;
    std::atexit([] { (void)flush_log(kAtExit); });
    last_words() = [](const char* text) {
      the_log().put(text);
      (void)flush_log(kAtExit);
    };
    return log;
  }();
  return *kOne;
}

}  // namespace

void set_log_name(const std::string& name) {
  the_log().name(name);
}

void set_log_format(LogFormat format) {
  the_log().format(format);
}

void log(LogLevel level, const std::string& text) {
  the_log().say(level, text);
}

bool flush_log(std::chrono::milliseconds limit) {
  return the_log().flush(limit);
}

std::uint64_t log_lines_left_out() {
  return the_log().left_out();
}

}  // namespace crane
