// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/pair_layout.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "imaging/jpeg.hpp"

namespace crane {
namespace {

constexpr std::uint32_t kShrink = 16;
/// Swapped pairs of 12 simulated scenes differ the wrong way by 0.23 to 0.54 of the right one;
/// where the floor's pattern repeats, 0.85 and 1.
constexpr double kSurely = 0.7;

/// Mean grey of cells of 16 x 16 pixels, times 64 and the channels.
std::vector<int> shrunk(const std::uint8_t* image, std::uint32_t width, std::uint32_t height,
                        std::uint32_t channels) {
  const std::uint32_t columns = width / kShrink;
  const std::uint32_t rows = height / kShrink;
  std::vector<int> cells(std::size_t{columns} * rows);
  for (std::uint32_t y = 0; y < rows * kShrink; ++y) {
    const std::uint8_t* row = image + std::size_t{y} * width * channels;
    for (std::uint32_t x = 0; x < columns * kShrink * channels; ++x)
      cells[std::size_t{y / kShrink} * columns + x / (kShrink * channels)] += row[x];
  }
  return cells;
}

/// Bytes of a row of `images`.
std::size_t packed_row(PairLayout layout, std::uint32_t width, std::size_t images = 2) {
  return std::size_t{width} * images * (layout == PairLayout::kSideBySideYuyv ? 2 : 1);
}

Result<void> split_jpeg(const std::uint8_t* frame, std::size_t bytes, std::uint32_t width,
                        std::uint32_t height, const std::string& name, const FrameBuffers& out,
                        FrameFacts& facts) {
  const std::uint32_t images = out.right == nullptr ? 1 : 2;
  auto both = decode_jpeg({frame, frame + bytes}, name, images * std::uint64_t{out.pixels});
  if (!both) return both.error();
  if (both->width != images * width || both->height != height ||
      std::size_t{width} * height * both->channels > out.bytes)
    return Error{ErrorCode::kWrongSize, name,
                 std::to_string(both->width) + " x " + std::to_string(both->height) +
                     " pixels, the camera's mode has " + std::to_string(images * width) + " x " +
                     std::to_string(height),
                 "unplug the camera and plug it in again"};
  const std::size_t row = std::size_t{width} * both->channels;
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* from = both->bytes.data() + images * y * row;
    std::memcpy(out.left + y * row, from, row);
    if (out.right != nullptr) std::memcpy(out.right + y * row, from + row, row);
  }
  facts.format = format_of_channels(both->channels);
  return {};
}

}  // namespace

std::optional<std::size_t> frame_bytes(PairLayout layout, std::uint32_t width,
                                       std::uint32_t height) {
  if (layout == PairLayout::kSideBySideJpeg) return std::nullopt;
  return packed_row(layout, width) * height;
}

Result<void> split_pair(PairLayout layout, const std::uint8_t* frame, std::size_t bytes,
                        std::uint32_t width, std::uint32_t height, std::size_t row_bytes,
                        const std::string& name, const FrameBuffers& out, FrameFacts& facts) {
  if (width == 0 || height == 0 || std::size_t{width} * height > std::min(out.pixels, out.bytes))
    return Error{ErrorCode::kWrongSize, name,
                 std::to_string(width) + " x " + std::to_string(height) + " pixels do not fit", ""};
  facts.width = width;
  facts.height = height;
  facts.format = PixelFormat::kMono8;
  if (layout == PairLayout::kSideBySideJpeg)
    return split_jpeg(frame, bytes, width, height, name, out, facts);
  const bool single = out.right == nullptr;
  if (single && layout == PairLayout::kInterleavedY8I)
    return Error{ErrorCode::kConfiguration, name, "y8i is of one camera with two images", ""};
  const std::size_t packed = packed_row(layout, width, single ? 1 : 2);
  const std::size_t step = row_bytes == 0 ? packed : row_bytes;
  if (step < packed || bytes < step * (height - 1) + packed)
    return Error{ErrorCode::kWrongSize, name,
                 "has " + std::to_string(bytes) + " bytes, its rows need " +
                     std::to_string(step * (height - 1) + packed),
                 "a cable, hub or port too slow for this mode"};
  for (std::size_t y = 0; y < height; ++y) {
    const std::uint8_t* from = frame + y * step;
    std::uint8_t* left = out.left + y * width;
    std::uint8_t* right = single ? nullptr : out.right + y * width;
    switch (layout) {
      case PairLayout::kSideBySideYuyv:
        for (std::size_t x = 0; x < width; ++x) left[x] = from[2 * x];
        if (single) break;
        for (std::size_t x = 0; x < width; ++x) right[x] = from[2 * (width + x)];
        break;
      case PairLayout::kInterleavedY8I:
        for (std::size_t x = 0; x < width; ++x) {
          left[x] = from[2 * x];
          right[x] = from[2 * x + 1];
        }
        break;
      default:
        std::memcpy(left, from, width);
        if (!single) std::memcpy(right, from + width, width);
    }
  }
  return {};
}

std::uint32_t repeated_rows(const std::uint8_t* image, std::uint32_t width, std::uint32_t height,
                            std::uint32_t channels) {
  const std::size_t row = std::size_t{width} * channels;
  std::uint32_t repeated = 0;
  for (std::uint32_t y = height; y > 1; --y, ++repeated)
    if (std::memcmp(image + (y - 1) * row, image + (y - 2) * row, row) != 0) break;
  const std::uint8_t* last = image + (height - 1) * row;
  return std::all_of(last, last + row, [&](std::uint8_t v) { return v == *last; }) ? 0 : repeated;
}

bool halves_swapped(const std::uint8_t* left, const std::uint8_t* right, std::uint32_t width,
                    std::uint32_t height, std::uint32_t channels) {
  const std::vector<int> a = shrunk(left, width, height, channels);
  const std::vector<int> b = shrunk(right, width, height, channels);
  const auto columns = static_cast<int>(width / kShrink);
  const auto rows = static_cast<int>(height / kShrink);
  if (columns < 8 || rows < 4) return false;
  // Mean difference per cell when the left image is shifted by so many cells.
  const auto difference = [&](int shift) {
    long sum = 0;
    const int from = std::max(0, shift);
    const int until = std::min(columns, columns + shift);
    for (int y = 0; y < rows; ++y)
      for (int x = from; x < until; ++x)
        sum += std::abs(a[static_cast<std::size_t>(y * columns + x)] -
                        b[static_cast<std::size_t>(y * columns + x - shift)]);
    return double(sum) / (double(rows) * (until - from));
  };
  double right_way = difference(0);
  double wrong_way = right_way;
  for (int shift = 1; shift <= columns / 3; ++shift) {
    right_way = std::min(right_way, difference(shift));
    wrong_way = std::min(wrong_way, difference(-shift));
  }
  return wrong_way < kSurely * right_way;
}

}  // namespace crane
