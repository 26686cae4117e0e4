// SPDX-License-Identifier: Apache-2.0
// Site configuration, and with it every typed read of YamlReader.
#include <cstdint>
#include <string>
#include <vector>

#include "base/utf8.hpp"
#include "config/reference.hpp"
#include "config/site_config.hpp"
#include "config/yaml_edit.hpp"
#include "config/yaml_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto config = crane::parse_site_config(text, "fuzz")) {
    const auto again = crane::parse_site_config(crane::to_yaml(*config), "again");
    if (!again || !crane::changed_keys(*again, *config).empty()) __builtin_trap();
    crane::SiteConfig wanted = *config;
    const auto same = crane::with_values(text, "fuzz", wanted);
    if (!same || *same != text) __builtin_trap();
    wanted.mapper.cart_direction = -wanted.mapper.cart_direction;
    wanted.mapper.trolley_offset_m += 0.125;
    wanted.hoist.offset_x_m = 0.25;
    for (auto& r : wanted.rangefinders) r.scale = 1.0 / 3;
    (void)crane::with_values(text, "fuzz", wanted);
  }
  (void)crane::described(text);
  if (crane::first_not_utf8(crane::with_bytes_escaped(text)) != std::string::npos) __builtin_trap();
  if (auto y = crane::YamlReader::from_text(text, "fuzz")) {
    std::vector<double> numbers;
    for (crane::YamlReader& item : y->items("obstacles")) item.numbers("size", numbers, 2);
    (void)y->finish();
  }
  return 0;
}
