// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "sim/renderer.hpp"

namespace crane {

/// A 16-bit grey PNG: depths, or images of a deep sensor. Error: Resource.
Result<void> write_grey16(const std::string& path, std::uint32_t width, std::uint32_t height,
                          std::vector<std::uint16_t> values);

/// truth/depth0/TIME.png of a camera that stands still.
Result<void> write_depth(const std::string& folder, TimeNs time, const Renderer& renderer,
                         const StereoRig& rig, const Eigen::Vector2d& at, double seconds);

/// truth/height_map and obstacles.yaml: what the renderer shows, as far as it was seen from
/// anywhere.
Result<void> write_truth(const std::string& folder, const Scene& scene, const Renderer& renderer,
                         const std::vector<Eigen::Vector2d>& seen_from, double end_s, double cell);

}  // namespace crane
