// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace crane {

enum class LogLevel { kInfo, kWarning, kError };
enum class LogFormat { kText, kJson };

/// Names the process in every line of its log; call once at start.
void set_log_name(const std::string& name);
/// Text for people, or one JSON object a line: time, level, service, text.
void set_log_format(LogFormat format);

/// One line on stderr: time, level, service, text. Any thread, and none waits for whoever reads
/// stderr: a thread of the log's own writes. At most 300 lines at once and 30 a second from then
/// on, and at most 1,000 that nobody has read yet: what is left out is counted, and the count said.
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

/// Waits until all is written, at most so long. Done when the process exits, and before it aborts.
/// False: not all of it is.
bool flush_log(std::chrono::milliseconds limit);

/// Lines that were never written.
std::uint64_t log_lines_left_out();

}  // namespace crane
