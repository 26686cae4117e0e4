// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/site_config.hpp"

namespace crane {

/// One thing that the configuration needs of its host or network.
struct Finding {
  enum class Verdict { kGood, kWarning, kBad };
  Verdict verdict = Verdict::kGood;
  std::string what;    ///< what was looked at
  std::string text;    ///< what was found
  std::string advice;  ///< what to do; empty when good
};

/// Looks at what the chosen network needs: shared memory, socket buffers, multicast, addresses,
/// servers, ports, the clock, and the certificates of every identity that is here. Takes a second;
/// changes nothing.
std::vector<Finding> examine_host(const SiteConfig& config);

/// Asks each rangefinder of the configuration for up to two seconds what it measures. Needs its
/// line for itself: a service that follows it already is said to be in use.
std::vector<Finding> examine_rangefinders(const SiteConfig& config);

/// Opens the camera of the configuration and waits up to three seconds for a pair. Likewise needs
/// it for itself.
std::vector<Finding> examine_camera(const SiteConfig& config);

/// Joins the network for some seconds: who is there, whose clock is off, and whose endpoints do not
/// match by their QoS, type or partition.
std::vector<Finding> examine_network(const SiteConfig& config, double seconds);

}  // namespace crane
