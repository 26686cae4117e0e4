// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/brightness_control.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr int kGainSteps = 32;
constexpr double kDeadBand = 0.2, kMostSaturated = 0.02;
constexpr std::uint8_t kSaturated = 250;

/// Of the first pixel of an even row, the byte that says most of its brightness: of colours the
/// green one.
std::size_t bright_byte(PixelFormat format) {
  switch (format) {
    case PixelFormat::kBgr8:
    case PixelFormat::kRgb8:
    case PixelFormat::kBayerRggb8:
    case PixelFormat::kBayerBggr8:
      return 1;
    default:
      return 0;
  }
}

}  // namespace

Brightness brightness_of(const FrameBuffers& pair, const FrameFacts& facts) {
  std::uint64_t sum = 0;
  std::uint64_t saturated = 0;
  std::uint64_t count = 0;
  const std::size_t pixel = bytes_per_pixel(facts.format);
  if (pixel == 0) return {};
  const std::size_t row = facts.width * pixel;
  const std::size_t byte = bright_byte(facts.format);
  for (const std::uint8_t* image : {pair.left, pair.right})
    for (std::size_t y = 0; y < facts.height; y += 8)
      for (std::size_t x = 0; x < facts.width; x += 16) {
        const std::uint8_t v = image[y * row + x * pixel + byte];
        sum += v;
        saturated += v >= kSaturated ? 1 : 0;
        ++count;
      }
  if (count == 0) return {};
  return {double(sum) / double(count), double(saturated) / double(count)};
}

std::optional<BrightnessControl::Setting> BrightnessControl::after(const Brightness& seen) {
  if (++frames_ < kSettle) return std::nullopt;
  double factor = target_ / std::max(seen.mean, 1.0);
  // Lamps in a dark hall: what is lost in them is worth more than what the mean says.
  if (seen.saturated > kMostSaturated) factor = std::min(factor, 0.75);
  factor = std::clamp(factor, 0.5, 2.0);
  at_limit_ = false;
  if (std::abs(factor - 1) <= kDeadBand) return std::nullopt;
  Setting next = now_;
  const int gain_step = std::max(1, (gain_.most - gain_.least) / kGainSteps);
  if (factor < 1 && next.gain > gain_.least) {
    next.gain = std::max(gain_.least, next.gain - gain_step);
  } else if (factor > 1 && next.exposure >= exposure_.most) {
    next.gain = std::min(gain_.most, next.gain + gain_step);
  } else {
    const auto wanted = static_cast<int>(std::lround(std::max(next.exposure, 1) * factor));
    // Rounding must not keep a short exposure where it is.
    const int moved = wanted == next.exposure ? wanted + (factor > 1 ? 1 : -1) : wanted;
    next.exposure = std::clamp(moved, exposure_.least, exposure_.most);
  }
  at_limit_ = next == now_;
  if (at_limit_) return std::nullopt;
  now_ = next;
  frames_ = 0;
  return next;
}

}  // namespace crane
