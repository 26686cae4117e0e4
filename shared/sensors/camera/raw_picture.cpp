// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/raw_picture.hpp"

#include <cstring>

#include "sensors/camera/pair_layout.hpp"

namespace crane {
namespace {

struct Row {
  std::string_view name;
  std::uint32_t pfnc;
  RawFormat format;
};

// By PFNC. A format's first name is the one to be written down.
constexpr Row kTable[] = {
    {"Mono8", 0x01080001, {PixelFormat::kMono8}},
    {"RGB8", 0x02180014, {PixelFormat::kRgb8}},
    {"RGB8Packed", 0x02180014, {PixelFormat::kRgb8}},
    {"BGR8", 0x02180015, {PixelFormat::kBgr8}},
    {"BGR8Packed", 0x02180015, {PixelFormat::kBgr8}},
    {"YUV422_8", 0x02100032, {PixelFormat::kYuyv}},
    {"YUV422_8_UYVY", 0x0210001F, {PixelFormat::kYuyv, true}},
    {"YUV422Packed", 0x0210001F, {PixelFormat::kYuyv, true}},
    {"BayerGR8", 0x01080008, {PixelFormat::kBayerGrbg8}},
    {"BayerRG8", 0x01080009, {PixelFormat::kBayerRggb8}},
    {"BayerGB8", 0x0108000A, {PixelFormat::kBayerGbrg8}},
    {"BayerBG8", 0x0108000B, {PixelFormat::kBayerBggr8}},
    {"Mono10p", 0x010A0046, {PixelFormat::kMono10p}},
    {"Mono12p", 0x010C0047, {PixelFormat::kMono12p}},
    {"BayerBG10p", 0x010A0052, {PixelFormat::kBayerBggr10p}},
    {"BayerBG12p", 0x010C0053, {PixelFormat::kBayerBggr12p}},
    {"BayerGB10p", 0x010A0054, {PixelFormat::kBayerGbrg10p}},
    {"BayerGB12p", 0x010C0055, {PixelFormat::kBayerGbrg12p}},
    {"BayerGR10p", 0x010A0056, {PixelFormat::kBayerGrbg10p}},
    {"BayerGR12p", 0x010C0057, {PixelFormat::kBayerGrbg12p}},
    {"BayerRG10p", 0x010A0058, {PixelFormat::kBayerRggb10p}},
    {"BayerRG12p", 0x010C0059, {PixelFormat::kBayerRggb12p}},
};

void copy_row(const std::uint8_t* from, std::size_t bytes, bool swap_bytes, std::uint8_t* to) {
  if (!swap_bytes) {
    std::memcpy(to, from, bytes);
    return;
  }
  for (std::size_t i = 0; i + 1 < bytes; i += 2) {
    to[i] = from[i + 1];
    to[i + 1] = from[i];
  }
}

}  // namespace

std::optional<RawFormat> raw_format_of(std::string_view genicam_name) {
  for (const Row& row : kTable)
    if (row.name == genicam_name) return row.format;
  return std::nullopt;
}

std::optional<RawFormat> raw_format_of(std::uint32_t pfnc) {
  for (const Row& row : kTable)
    if (row.pfnc == pfnc) return row.format;
  return std::nullopt;
}

std::string known_raw_formats() {
  std::string out;
  for (const Row& row : kTable) out += (out.empty() ? "" : ", ") + std::string(row.name);
  return out;
}

Result<void> unpack(const RawPicture& p, bool swap, const std::string& name,
                    const FrameBuffers& out, FrameFacts& facts) {
  const bool pair = out.right != nullptr;
  const std::uint32_t width = pair ? p.width / 2 : p.width;
  const std::string size = std::to_string(p.width) + " x " + std::to_string(p.height);
  // Of a row of one image; the picture's is one or two of them.
  const auto packed = image_bytes(p.format.pixels, width, 1);
  if (!packed || *packed == 0 || (pair && p.width % 2 != 0))
    return Error{ErrorCode::kWrongSize, name,
                 size + " pixels of " + name_of(p.format.pixels) + " are no " +
                     (pair ? "two halves" : "image"),
                 "choose another mode of the camera"};
  const std::size_t whole = pair ? 2 * *packed : *packed;
  const std::size_t step = p.row_bytes == 0 ? whole : p.row_bytes;
  if (p.data == nullptr || p.height == 0 || step < whole || p.bytes < whole ||
      (p.bytes - whole) / step < p.height - 1)
    return Error{ErrorCode::kWrongSize, name,
                 "has " + std::to_string(p.bytes) + " bytes, too few for " + size + " pixels",
                 "is the network or the port fast enough for this mode?"};
  if (std::uint64_t{width} * p.height > out.pixels || *packed * p.height > out.bytes)
    return Error{ErrorCode::kWrongSize, name, size + " pixels are too many",
                 "choose another mode of the camera"};
  facts.width = width;
  facts.height = p.height;
  facts.format = p.format.pixels;
  std::uint8_t* first = swap && pair ? out.right : out.left;
  std::uint8_t* second = swap && pair ? out.left : out.right;
  for (std::size_t y = 0; y < p.height; ++y) {
    const std::uint8_t* from = p.data + y * step;
    copy_row(from, *packed, p.format.swap_bytes, first + y * *packed);
    if (pair) copy_row(from + *packed, *packed, p.format.swap_bytes, second + y * *packed);
  }
  return {};
}

bool pair_swapped(const FrameBuffers& pair, const FrameFacts& facts) {
  const std::uint32_t pixel = bytes_per_pixel(facts.format);
  return pixel > 0 && pair.right != nullptr &&
         halves_swapped(pair.left, pair.right, facts.width, facts.height, pixel);
}

}  // namespace crane
