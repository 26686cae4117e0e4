// SPDX-License-Identifier: Apache-2.0
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

/// Prometheus' own tool does not like metres to be called m.
std::string with_unit_spelt_out(std::string name) {
  for (const auto& [end, unit] : {std::pair{"_m", "_meters"}, {"_s", "_seconds"}})
    if (name.ends_with(end)) return name.replace(name.size() - 2, 2, unit);
  return name;
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
  Text(std::uint32_t crane, std::uint32_t service)
      : labels_("crane=\"" + std::to_string(crane) + "\",service=\"" + service_name(service) +
                "\"") {
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
  void gauge(const Gauge& g, bool first) {
    const std::string full = "cranemap_" + g.name;
    if (first) family(full.c_str(), g.counts ? "counter" : "gauge", g.help.c_str());
    value(full, g.value, g.label);
  }
  [[nodiscard]] std::string str() const { return text_.str(); }

 private:
  std::string labels_;
  std::ostringstream text_;
};

}  // namespace

std::string to_metric(std::uint32_t crane, std::uint32_t service, const Gauge& gauge) {
  Text t(crane, service);
  t.gauge(gauge, true);
  return t.str();
}

std::string to_metrics(const v1::ServiceStatus& s, const std::vector<StageHistogram>& stages,
                       const std::vector<Gauge>& gauges) {
  Text t(s.crane(), s.service());
  t.family("cranemap_build_info", "gauge", "Always 1; version and build type are its labels.");
  t.value("cranemap_build_info", 1,
          "version=\"" + label(s.version().c_str()) + "\",build_type=\"" +
              label(s.build_type().c_str()) + "\"");
  t.one("cranemap_status", "gauge", "0 ok, 1 degraded, 2 failed.", s.status());
  t.one("cranemap_start_time_seconds", "gauge", "Start of the service, Unix epoch.",
        double(s.start_ns()) * 1e-9);
  t.one("cranemap_told_time_seconds", "gauge", "When the service last told of itself, Unix epoch.",
        double(s.time_ns()) * 1e-9);
  t.one("cranemap_received_total", "counter", "Samples taken in.", double(s.received()));
  t.one("cranemap_published_total", "counter", "Samples handed on.", double(s.published()));
  t.family("cranemap_dropped_total", "counter", "What was not used, by cause.");
  for (const v1::DropCount& d : s.dropped())
    t.value("cranemap_dropped_total", double(d.count()),
            "cause=\"" + label(d.cause().c_str()) + "\"");
  t.family("cranemap_stage_duration_seconds", "histogram", "What a stage takes.");
  for (const StageHistogram& h : stages) {
    const std::string stage = "stage=\"" + label(h.name) + "\"";
    for (std::size_t i = 0; i < kStageBounds_s.size(); ++i) {
      std::ostringstream bound;
      bound << kStageBounds_s[i];
      t.value("cranemap_stage_duration_seconds_bucket", double(h.at_most[i]),
              stage + ",le=\"" + bound.str() + "\"");
    }
    t.value("cranemap_stage_duration_seconds_bucket", double(h.count), stage + ",le=\"+Inf\"");
    t.value("cranemap_stage_duration_seconds_sum", h.sum_s, stage);
    t.value("cranemap_stage_duration_seconds_count", double(h.count), stage);
  }
  for (const v1::StatusFigure& f : s.figures()) {
    const std::string full = "cranemap_" + with_unit_spelt_out(f.name().c_str());
    t.family(full.c_str(), "gauge", "Measured by the watchdog; see shared/watchdog/README.md.");
    t.value(full, f.value());
    const std::string sigma = full + "_sigma";
    t.family(sigma.c_str(), "gauge", "Its standard deviation.");
    t.value(sigma, f.sigma());
  }
  for (std::size_t i = 0; i < gauges.size(); ++i)
    t.gauge(gauges[i], i == 0 || gauges[i].name != gauges[i - 1].name);
  t.one("process_cpu_seconds_total", "counter", "User and system time.", s.cpu_seconds());
  t.one("process_resident_memory_bytes", "gauge", "Resident memory.", double(s.memory_bytes()));
  t.one("process_open_fds", "gauge", "Open file descriptors.", entries("/proc/self/fd"));
  t.one("process_threads", "gauge", "Threads.", entries("/proc/self/task"));
  return t.str();
}

}  // namespace crane
