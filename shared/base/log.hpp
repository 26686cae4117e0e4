#pragma once

#include <string>

namespace crane {

enum class LogLevel { kInfo, kWarning, kError };
enum class LogFormat { kText, kJson };

/// Names the process in every line of its log; call once at start.
void set_log_name(const std::string& name);
/// Text for people, or one JSON object a line: time, level, service, text.
void set_log_format(LogFormat format);

/// One line on stderr: time, level, service, text. Thread-safe. At most 300 lines at once and 30 a
/// second from then on: what floods the log is counted, and the count is said.
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
