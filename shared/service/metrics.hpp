#pragma once

#include <map>
#include <string>

#include "dds/topics.hpp"

namespace crane {

/// A service's status in Prometheus' text format, with what the process itself uses. `values`:
/// gauges by their names without "cranemap_".
std::string to_metrics(const v1::ServiceStatus& status,
                       const std::map<std::string, double>& values);

}  // namespace crane
