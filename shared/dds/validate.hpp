// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "dds/topics.hpp"

namespace crane::dds {

/// Of an octree, unpacked [bytes]: eight times what may travel.
inline constexpr std::uint32_t kMaxOctreeDecoded = 256U << 20U;

// What must hold before a received sample is used: nullptr, or what is wrong with it.
// Everything from the network is hostile until it passed here. Payload checksums and encodings
// are the decoders' work (map_codec).

const char* flaw(const StereoFrame& sample);
const char* flaw(const v1::RangefinderPosition& sample);
const char* flaw(const v1::HoistState& sample);
const char* flaw(const PartialCloud& sample);
const char* flaw(const v1::MapTile& sample);
const char* flaw(const v1::HeightTile& sample);
const char* flaw(const v1::OctreeMap& sample);
const char* flaw(const v1::MapStatus& sample);
const char* flaw(const v1::TileRequest& sample);
const char* flaw(const v1::ZoneSet& sample);
const char* flaw(const v1::ZoneCommand& sample);
const char* flaw(const v1::ClearanceRequest& sample);
const char* flaw(const v1::ClearanceReply& sample);
const char* flaw(const v1::ServiceStatus& sample);

}  // namespace crane::dds
