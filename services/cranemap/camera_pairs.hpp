// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "config/site_config.hpp"
#include "imaging/image.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

/// Pairs of the camera that a configuration names, taken from its driver without any service. Needs
/// the camera for itself.
class CameraPairs {
 public:
  /// Error: Configuration, where the configuration names no live camera, or what it names is wrong;
  /// NotAvailable, Resource: as its driver says.
  static Result<CameraPairs> open(const SiteConfig& config);

  struct Pair {
    Image left, right;  ///< grey, or BGR of a colour camera
  };
  /// The newest pair. Error: BadData for what is no image; NotAvailable, when none came in time.
  Result<Pair> next(double patience_s);

 private:
  explicit CameraPairs(std::unique_ptr<StereoDevice> device) : device_(std::move(device)) {}
  std::unique_ptr<StereoDevice> device_;
  std::vector<std::uint8_t> left_, right_;
};

}  // namespace crane
