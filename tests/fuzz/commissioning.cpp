// SPDX-License-Identifier: Apache-2.0
// commissioning.yaml and what the command line says of targets.
#include <cstdint>
#include <string>

#include "mount/commissioning.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto read = crane::parse_commissioning(text, "fuzz")) {
    const auto again = crane::parse_commissioning(crane::to_yaml(*read), "again");
    if (!again || again.value().values.size() != read.value().values.size()) __builtin_trap();
  }
  (void)crane::parse_floor_target(text);
  return 0;
}
