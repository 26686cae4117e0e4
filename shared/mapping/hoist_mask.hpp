// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "cloud/point_cloud.hpp"
#include "mapping/hoist.hpp"

namespace crane {

/// Takes the match from every pixel whose ray passes a body (kNotLookedAt): neither a surface nor
/// free space is made of it, and nothing that was known there is taken back. `depth_m`: of the
/// frame, height x width. Returns how many pixels lost a match. Cost O(bodies + pixels covered).
std::size_t mask_bodies(const Bodies& bodies, const DepthFrame& frame, std::span<float> depth_m);

}  // namespace crane
