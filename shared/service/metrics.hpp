// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/stage_times.hpp"
#include "dds/topics.hpp"

namespace crane {

/// A figure that only one kind of service has.
struct Gauge {
  std::string name;  ///< without "cranemap_"
  std::string help;  ///< one line
  double value = 0;
  std::string label;    ///< further ones, `reason="no_clouds"`; may be empty. Those of one name
                        ///< follow each other
  bool counts = false;  ///< a counter: it only rises
};

/// A service's status in Prometheus' text format, with what the process itself uses.
std::string to_metrics(const v1::ServiceStatus& status, const std::vector<StageHistogram>& stages,
                       const std::vector<Gauge>& gauges);

/// One gauge more, for what is known only when it is asked for.
std::string to_metric(std::uint32_t crane, std::uint32_t service, const Gauge& gauge);

}  // namespace crane
