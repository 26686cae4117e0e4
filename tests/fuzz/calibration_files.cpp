// SPDX-License-Identifier: Apache-2.0
// Calibrations of others. The first byte says the format, a form feed parts two files.
#include "calibration_files/calibration_files.hpp"

#include <cstdint>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto format = static_cast<crane::CalibrationFormat>(data[0] % 9);
  const std::size_t part = text.find('\f');
  crane::Texts texts = {{"first", text.substr(0, part)}};
  if (part != std::string::npos) texts.push_back({"second", text.substr(part + 1)});
  const auto rig = crane::parse_calibration(texts, format, {1280, 720});
  if (!rig && rig.error().what.empty()) __builtin_trap();
  return 0;
}
