// SPDX-License-Identifier: Apache-2.0
// What arrives on a rangefinder's line: the first byte says of which make.
#include <cmath>
#include <cstdint>

#include "sensors/distance/distance_protocol.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using crane::RangefinderConfig;
  if (size == 0) return 0;
  RangefinderConfig c;
  using Device = RangefinderConfig::Device;
  c.device = static_cast<Device>(data[0] % 9);
  if (c.device == Device::kModbus) c.device = Device::kWcs;  // registers are no bytes of ours
  c.polled = (data[0] & 0x80U) != 0;
  c.unit_m = 1e-3;
  c.port = (data[0] & 0x40U) != 0 ? "udp://127.0.0.1:1" : "tcp://127.0.0.1:1";
  c.telegram = {.length = 12,
                .value_offset = 4,
                .value_type = static_cast<crane::PlcNumber>(data[0] >> 3U & 3U),
                .heartbeat_offset = 0};
  const auto protocol = crane::make_distance_protocol(c);
  crane::DeviceTalk talk;
  for (std::size_t at = 1; at < size;) {  // in pieces of 1 to 16 bytes
    const std::size_t n = std::min<std::size_t>(1 + data[at] % 16, size - at);
    protocol->take({data + at, n}, talk);
    at += n;
  }
  for (const crane::DeviceSaid& said : talk)
    if (!std::isfinite(said.value)) __builtin_trap();
  if (talk.size() > 4 * size) __builtin_trap();
  return 0;
}
