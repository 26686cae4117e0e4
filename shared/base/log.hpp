#pragma once

#include <string>

namespace crane {

enum class LogLevel { kInfo, kWarning, kError };

/// Names the process in every line of its log; call once at start.
void set_log_name(const std::string& name);

/// One line on stderr: time, level, service, text. Thread-safe.
void log(LogLevel level, const std::string& text);

inline void log_info(const std::string& text) {
  log(LogLevel::kInfo, text);
}
inline void log_warning(const std::string& text) {
  log(LogLevel::kWarning, text);
}
inline void log_error(const std::string& text) {
  log(LogLevel::kError, text);
}

}  // namespace crane
