#include "sensors/camera/raw_picture.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace crane {
namespace {

struct Row {
  RawFormat format;
  std::string_view name;
  std::uint32_t pfnc;
  std::size_t bytes;     ///< of a pixel
  std::size_t channels;  ///< as it is handed on
};

// The first name of a format is the one to be written down.
constexpr Row kTable[] = {
    {RawFormat::kMono8, "Mono8", 0x01080001, 1, 1},
    {RawFormat::kRgb8, "RGB8", 0x02180014, 3, 3},
    {RawFormat::kRgb8, "RGB8Packed", 0x02180014, 3, 3},
    {RawFormat::kBgr8, "BGR8", 0x02180015, 3, 3},
    {RawFormat::kBgr8, "BGR8Packed", 0x02180015, 3, 3},
    {RawFormat::kYuyv, "YUV422_8", 0x02100032, 2, 1},
    {RawFormat::kUyvy, "YUV422_8_UYVY", 0x0210001F, 2, 1},
    {RawFormat::kUyvy, "YUV422Packed", 0x0210001F, 2, 1},
};

const Row& row_of(RawFormat format) {
  return *std::find_if(std::begin(kTable), std::end(kTable),
                       [format](const Row& row) { return row.format == format; });
}

void copy_row(RawFormat format, const std::uint8_t* from, std::size_t width, std::uint8_t* to) {
  switch (format) {
    case RawFormat::kMono8:
      std::memcpy(to, from, width);
      break;
    case RawFormat::kBgr8:
      std::memcpy(to, from, 3 * width);
      break;
    case RawFormat::kRgb8:
      for (std::size_t x = 0; x < 3 * width; x += 3) {
        to[x] = from[x + 2];
        to[x + 1] = from[x + 1];
        to[x + 2] = from[x];
      }
      break;
    case RawFormat::kYuyv:
      for (std::size_t x = 0; x < width; ++x) to[x] = from[2 * x];
      break;
    case RawFormat::kUyvy:
      for (std::size_t x = 0; x < width; ++x) to[x] = from[2 * x + 1];
      break;
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

std::size_t bytes_per_raw_pixel(RawFormat format) {
  return row_of(format).bytes;
}

std::size_t unpacked_bytes(RawFormat format) {
  return row_of(format).channels;
}

Result<void> unpack(const RawPicture& p, bool swap, const std::string& name,
                    const FrameBuffers& out, FrameFacts& facts) {
  const Row& row = row_of(p.format);
  const bool pair = out.right != nullptr;
  const std::size_t packed = row.bytes * p.width;
  const std::size_t step = p.row_bytes == 0 ? packed : p.row_bytes;
  const std::string size = std::to_string(p.width) + " x " + std::to_string(p.height);
  if (p.data == nullptr || p.width == 0 || p.height == 0 || step < packed || p.bytes < packed ||
      (p.bytes - packed) / step < p.height - 1)
    return Error{ErrorCode::kWrongSize, name,
                 "has " + std::to_string(p.bytes) + " bytes, too few for " + size + " pixels",
                 "is the network or the port fast enough for this mode?"};
  const std::size_t width = pair ? p.width / 2 : p.width;
  if ((pair && p.width % 2 != 0) || width * p.height > out.pixels ||
      width * p.height * row.channels > out.bytes)
    return Error{ErrorCode::kWrongSize, name,
                 size + " pixels are " + (pair && p.width % 2 != 0 ? "no two halves" : "too many"),
                 "choose another mode of the camera"};
  facts.width = static_cast<std::uint32_t>(width);
  facts.height = p.height;
  facts.channels = static_cast<std::uint32_t>(row.channels);
  std::uint8_t* first = swap && pair ? out.right : out.left;
  std::uint8_t* second = swap && pair ? out.left : out.right;
  for (std::size_t y = 0; y < p.height; ++y) {
    const std::uint8_t* from = p.data + y * step;
    const std::size_t at = y * width * row.channels;
    copy_row(p.format, from, width, first + at);
    if (pair) copy_row(p.format, from + width * row.bytes, width, second + at);
  }
  return {};
}

}  // namespace crane
