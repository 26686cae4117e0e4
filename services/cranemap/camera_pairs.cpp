// SPDX-License-Identifier: Apache-2.0
#include "camera_pairs.hpp"

#include <chrono>

#include "base/format.hpp"
#include "imaging/convert.hpp"
#include "sensors/camera/camera_device.hpp"
#include "service/run_service.hpp"

namespace crane {

using namespace std::chrono_literals;

Result<CameraPairs> CameraPairs::open(const SiteConfig& config) {
  auto device = make_camera_device(config.camera, std::nullopt, kMaxImagePixels);
  if (!device) return device.error();
  if (*device == nullptr)
    return Error{ErrorCode::kConfiguration, "camera.source", "names no live camera",
                 "say how the camera is connected: docs/sensors.md"};
  if (auto opened = (*device)->open(); !opened) return opened.error();
  CameraPairs pairs(std::move(*device));
  pairs.left_.resize(kMaxImageBytes);
  pairs.right_.resize(kMaxImageBytes);
  return pairs;
}

Result<CameraPairs::Pair> CameraPairs::next(double patience_s) {
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<int>(1000 * patience_s));
  FrameFacts facts;
  DropCounts dropped;
  while (std::chrono::steady_clock::now() < end && !stop_requested()) {
    const auto got =
        device_->grab({left_.data(), right_.data(), left_.size(), kMaxImagePixels}, facts,
                      std::min(end, std::chrono::steady_clock::now() + 100ms), dropped);
    if (!got) return got.error();
    if (!*got) continue;
    const auto image = [&facts](const std::vector<std::uint8_t>& bytes, std::size_t size) {
      return to_image({facts.format, facts.width, facts.height,
                       std::span(bytes).first(size > 0 ? size : bytes.size())});
    };
    auto left = image(left_, facts.left_bytes);
    if (!left) return left.error();
    auto right = image(right_, facts.right_bytes);
    if (!right) return right.error();
    return Pair{std::move(*left), std::move(*right)};
  }
  if (const std::string remark = device_->remark(); !remark.empty())
    return Error{ErrorCode::kNotAvailable, "camera", remark, ""};
  return Error{ErrorCode::kNotAvailable, "camera",
               formatted("gave no pair within %.0f s", patience_s),
               "is it on, and triggered? docs/sensors.md"};
}

}  // namespace crane
