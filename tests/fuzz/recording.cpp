// SPDX-License-Identifier: Apache-2.0
// data.csv, that of hoist0, images and what is around them. (Pixels are libpng's and libjpeg's.)
#include <cstdint>
#include <string>
#include <vector>

#include "recording/csv.hpp"
#include "recording/hoist_csv.hpp"
#include "recording/image_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  (void)crane::parse_time_csv(text, "fuzz");
  (void)crane::parse_hoist_csv(text, "fuzz");
  for (const int bits : {0, 12}) {
    const auto image = crane::decode_image({data, data + size}, "fuzz", 4096, bits);
    if (image && image->bytes.size() != std::size_t{image->width} * image->height * image->channels)
      __builtin_trap();
  }
  return 0;
}
