#include "service/metrics.hpp"

#include <filesystem>
#include <sstream>

#include "service/service_name.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

/// A label's value: Prometheus escapes backslash, quote and line end.
std::string label(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

double entries(const char* folder) {
  std::error_code failed;
  double count = 0;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed))
    ++count;
  return count;
}

class Text {
 public:
  explicit Text(const v1::ServiceStatus& s)
      : labels_("crane=\"" + std::to_string(s.crane()) + "\",service=\"" +
                service_name(s.service()) + "\"") {
    text_.precision(15);
  }
  void family(const char* name, const char* type, const char* help) {
    text_ << "# HELP " << name << " " << help << "\n# TYPE " << name << " " << type << "\n";
  }
  void value(const std::string& name, double v, const std::string& more = "") {
    text_ << name << "{" << labels_ << (more.empty() ? "" : ",") << more << "} " << v << "\n";
  }
  void one(const char* name, const char* type, const char* help, double v) {
    family(name, type, help);
    value(name, v);
  }
  [[nodiscard]] std::string str() const { return text_.str(); }

 private:
  std::string labels_;
  std::ostringstream text_;
};

}  // namespace

std::string to_metrics(const v1::ServiceStatus& s, const std::map<std::string, double>& values) {
  Text t(s);
  t.family("cranemap_build_info", "gauge", "Always 1; version and build type are its labels.");
  t.value("cranemap_build_info", 1,
          "version=\"" + label(s.version().c_str()) + "\",build_type=\"" +
              label(s.build_type().c_str()) + "\"");
  t.one("cranemap_status", "gauge", "0 ok, 1 degraded, 2 failed.", s.status());
  t.one("cranemap_start_time_seconds", "gauge", "Start of the service, Unix epoch.",
        double(s.start_ns()) * 1e-9);
  t.one("cranemap_received_total", "counter", "Samples taken in.", double(s.received()));
  t.one("cranemap_published_total", "counter", "Samples handed on.", double(s.published()));
  t.family("cranemap_dropped_total", "counter", "What was not used, by cause.");
  for (const v1::DropCount& d : s.dropped())
    t.value("cranemap_dropped_total", double(d.count()),
            "cause=\"" + label(d.cause().c_str()) + "\"");
  t.family("cranemap_stage_seconds", "gauge", "Duration of a stage since the start.");
  for (const v1::StageTime& stage : s.stages()) {
    const std::string name = "stage=\"" + label(stage.stage().c_str()) + "\"";
    t.value("cranemap_stage_seconds", stage.p50_ms() * 1e-3, name + ",quantile=\"0.5\"");
    t.value("cranemap_stage_seconds", stage.p99_ms() * 1e-3, name + ",quantile=\"0.99\"");
    t.value("cranemap_stage_seconds", stage.max_ms() * 1e-3, name + ",quantile=\"1\"");
  }
  t.family("cranemap_stage_runs_total", "counter", "How often a stage ran.");
  for (const v1::StageTime& stage : s.stages())
    t.value("cranemap_stage_runs_total", double(stage.count()),
            "stage=\"" + label(stage.stage().c_str()) + "\"");
  for (const v1::StatusFigure& f : s.figures()) {
    const std::string full = std::string("cranemap_") + f.name().c_str();
    t.family(full.c_str(), "gauge", "Measured by the watchdog; see shared/watchdog/README.md.");
    t.value(full, f.value());
    const std::string sigma = full + "_sigma";
    t.family(sigma.c_str(), "gauge", "Its standard deviation.");
    t.value(sigma, f.sigma());
  }
  for (const auto& [name, v] : values) {
    const std::string full = "cranemap_" + name;
    t.family(full.c_str(), "gauge", "See services/README.md.");
    t.value(full, v);
  }
  t.one("process_cpu_seconds_total", "counter", "User and system time.", s.cpu_seconds());
  t.one("process_resident_memory_bytes", "gauge", "Resident memory.", double(s.memory_bytes()));
  t.one("process_open_fds", "gauge", "Open file descriptors.", entries("/proc/self/fd"));
  t.one("process_threads", "gauge", "Threads.", entries("/proc/self/task"));
  return t.str();
}

}  // namespace crane
