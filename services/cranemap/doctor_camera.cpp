// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>

#include "doctor.hpp"
#include "sensors/camera/camera_device.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr auto kPatience = 3s;

Finding refused(const Error& error) {
  const bool busy = error.what.find("another program") != std::string::npos;
  return {busy ? Finding::Verdict::kWarning : Finding::Verdict::kBad, "camera",
          error.where + ": " + error.what,
          busy ? "a service uses it already, or: " + error.todo : error.todo};
}

/// A sentence of a device, "what is wrong -> what to do".
Finding said(Finding::Verdict verdict, const std::string& text) {
  const auto advice = text.find(" -> ");
  return {verdict, "camera", text.substr(0, advice),
          advice == std::string::npos ? "see docs/sensors.md" : text.substr(advice + 4)};
}

}  // namespace

std::vector<Finding> examine_camera(const SiteConfig& config) {
  auto device = make_camera_device(config.camera, std::nullopt, kMaxImagePixels);
  if (!device) return {refused(device.error())};
  if (*device == nullptr) return {};
  if (auto opened = (*device)->open(); !opened) return {refused(opened.error())};
  std::vector<std::uint8_t> left(kMaxImageBytes);
  std::vector<std::uint8_t> right(kMaxImageBytes);
  FrameFacts facts;
  DropCounts dropped;
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < end) {
    const auto got =
        (*device)->grab({left.data(), right.data(), left.size(), kMaxImagePixels}, facts,
                        std::min(end, std::chrono::steady_clock::now() + 100ms), dropped);
    if (!got) return {refused(got.error())};
    if (!*got) continue;
    std::string gives = "gives pairs of " + std::to_string(facts.width) + " x " +
                        std::to_string(facts.height) + " pixels";
    if (!(*device)->about().empty()) gives += "; " + (*device)->about();
    std::vector<Finding> out = {{Finding::Verdict::kGood, "camera", gives, ""}};
    if (!(*device)->remark().empty())
      out.push_back(said(Finding::Verdict::kWarning, (*device)->remark()));
    return out;
  }
  if (!(*device)->remark().empty()) return {said(Finding::Verdict::kBad, (*device)->remark())};
  // A folder to which nobody writes just now is none the worse for it.
  const bool folder = config.camera.source == CameraConfig::Source::kFolder;
  return {{folder ? Finding::Verdict::kWarning : Finding::Verdict::kBad, "camera",
           "gave no pair within 3 s", "is it on, and triggered? docs/sensors.md"}};
}

}  // namespace crane
