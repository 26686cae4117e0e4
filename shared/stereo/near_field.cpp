// SPDX-License-Identifier: Apache-2.0
#include "stereo/near_field.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "stereo/evidence.hpp"

namespace crane {
namespace {

constexpr int kShrink = 4;
/// Of the 3 x 3 around a near pixel so many must lie on its surface, itself included.
constexpr int kMinSupport = 5;
/// A small pixel with so many proven of its 16 full ones shows what those do.
constexpr int kProven = 8;

}  // namespace

struct NearField::Impl {
  NearFieldRange range;
  cv::Size full, size;
  SemiGlobalMatcher matcher;
  Evidence evidence;
  cv::Mat left, right;
  std::vector<std::int16_t> disparity;
  std::vector<std::uint8_t> confidence, near;

  Impl(cv::Size full_size, const NearFieldRange& r, const SemiGlobalSettings& settings)
      : range(r),
        full(full_size),
        size(full_size.width / kShrink, full_size.height / kShrink),
        matcher(size.width, size.height, settings),
        evidence(settings.threads),
        disparity(std::size_t(size.area())),
        confidence(std::size_t(size.area())),
        near(std::size_t(size.area())) {}

  /// Marks small pixels that are nearer than the search of the full images, with a surface around.
  void find() {
    const int limit = (range.last_px + kShrink) * kDisparityScale / kShrink;
    std::fill(near.begin(), near.end(), std::uint8_t{0});
    for (int y = 1; y + 1 < size.height; ++y)
      for (int x = 1; x + 1 < size.width; ++x) {
        const std::ptrdiff_t at = std::ptrdiff_t(y) * size.width + x;
        const std::int16_t* d = disparity.data() + at;
        if (*d <= limit) continue;
        int support = 0;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx)
            support += std::abs(d[dy * size.width + dx] - *d) <= kDisparityScale ? 1 : 0;
        if (support >= kMinSupport) near[std::size_t(at)] = 1;
      }
  }

  /// What the full images have proven is not near.
  void leave_proven(std::span<const std::int16_t> full_disparity) {
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        std::uint8_t& mark = near[std::size_t(y) * std::size_t(size.width) + std::size_t(x)];
        if (mark == 0) continue;
        int proven = 0;
        for (int v = y * kShrink; v < (y + 1) * kShrink; ++v)
          for (int u = x * kShrink; u < (x + 1) * kShrink; ++u)
            proven += full_disparity[std::size_t(v) * std::size_t(full.width) + std::size_t(u)] > 0;
        if (proven >= kProven) mark = 0;
      }
  }

  /// Whether a neighbour is near.
  [[nodiscard]] bool beside(int x, int y) const {
    for (int v = std::max(0, y - 1); v <= std::min(size.height - 1, y + 1); ++v)
      for (int u = std::max(0, x - 1); u <= std::min(size.width - 1, x + 1); ++u)
        if (near[std::size_t(v) * std::size_t(size.width) + std::size_t(u)] != 0) return true;
    return false;
  }
};

NearField::NearField(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
NearField::~NearField() = default;
NearField::NearField(NearField&&) noexcept = default;
NearField& NearField::operator=(NearField&&) noexcept = default;

std::optional<NearField> NearField::create(int width, int height, const NearFieldRange& range,
                                           int threads) {
  const int small_width = width / kShrink;
  SemiGlobalSettings settings;
  settings.threads = threads;
  settings.first_px = range.first_px / kShrink;
  const int last = std::min(range.nearest_px / kShrink, small_width / 2);
  if (last * kShrink <= range.last_px + kShrink) return std::nullopt;
  settings.count_px = std::min(256, last - settings.first_px + 1);
  if (small_width < SemiGlobalMatcher::kMinWidth ||
      height / kShrink < SemiGlobalMatcher::kMinHeight || small_width <= settings.first_px + 8)
    return std::nullopt;
  return NearField(std::make_unique<Impl>(cv::Size(width, height), range, settings));
}

NearFieldReport NearField::apply(const GreyView& left, const GreyView& right,
                                 std::span<std::int16_t> disparity,
                                 std::span<std::uint8_t> confidence) {
  Impl& m = *impl_;
  const auto shrink = [&](const GreyView& from, cv::Mat& to) {
    const cv::Mat image(m.size.height * kShrink, m.size.width * kShrink, CV_8U,
                        const_cast<std::uint8_t*>(from.pixels), std::size_t(from.stride));
    cv::resize(image, to, m.size, 0, 0, cv::INTER_AREA);
    return GreyView{to.data, to.cols, to.rows, static_cast<std::ptrdiff_t>(to.step)};
  };
  const GreyView small_left = shrink(left, m.left);
  const GreyView small_right = shrink(right, m.right);
  NearFieldReport report;
  constexpr std::uint32_t kPixels = kShrink * kShrink;
  report.too_near =
      kPixels * m.matcher.match(small_left, small_right, m.disparity, m.confidence).at_near_end;
  (void)m.evidence.keep_proven(small_left, small_right, m.disparity, m.confidence);
  m.find();
  m.leave_proven(disparity);
  for (int y = 0; y < m.size.height; ++y)
    for (int x = 0; x < m.size.width; ++x) {
      if (!m.beside(x, y)) continue;
      const std::size_t at = std::size_t(y) * std::size_t(m.size.width) + std::size_t(x);
      const bool near = m.near[at] != 0;
      report.matched += near ? kPixels : 0;
      const auto d = near ? static_cast<std::int16_t>(m.disparity[at] * kShrink) : std::int16_t{0};
      // An error of the small image counts as many times in the full one.
      const auto c = near ? static_cast<std::uint8_t>(std::max(1, m.confidence[at] / kShrink))
                          : std::uint8_t{0};
      for (int v = y * kShrink; v < (y + 1) * kShrink; ++v) {
        const std::size_t to =
            std::size_t(v) * std::size_t(m.full.width) + std::size_t(x) * kShrink;
        std::fill_n(disparity.begin() + std::ptrdiff_t(to), kShrink, d);
        std::fill_n(confidence.begin() + std::ptrdiff_t(to), kShrink, c);
      }
    }
  return report;
}

}  // namespace crane
