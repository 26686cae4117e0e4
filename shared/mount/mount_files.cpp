// SPDX-License-Identifier: Apache-2.0
#include "mount/mount_files.hpp"

#include <algorithm>
#include <ctime>
#include <filesystem>

#include "base/write_file.hpp"
#include "config/yaml_edit.hpp"
#include "mount/commissioning.hpp"
#include "recording/calibration.hpp"

namespace crane {
namespace {

constexpr double kRate_Hz = 10;  ///< written for who reads the folder as a recording

Result<void> write(const std::string& path, const std::string& text) {
  return write_file(path, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &parts);
  return text;
}

}  // namespace

void apply(const MountCalibration& c, SiteConfig& site) {
  site.mapper = c.mapper;
  for (RangefinderConfig& r : site.rangefinders)
    r.scale *= c.scale[r.axis == RangefinderConfig::Axis::kCart ? 0 : 1];
  for (const MountItem item : {MountItem::kHookX, MountItem::kHookY})
    if (c.of(item).determined)
      (item == MountItem::kHookX ? site.hoist.offset_x_m : site.hoist.offset_y_m) =
          c.of(item).value;
}

MountCalibration of_devices(MountCalibration c, const SiteConfig& site) {
  for (const auto axis : {RangefinderConfig::Axis::kCart, RangefinderConfig::Axis::kTrolley}) {
    const auto first = std::find_if(site.rangefinders.begin(), site.rangefinders.end(),
                                    [axis](const auto& r) { return r.axis == axis; });
    if (first == site.rangefinders.end()) continue;
    MountValue& scale = c.values[static_cast<std::size_t>(
        axis == RangefinderConfig::Axis::kCart ? MountItem::kCartScale : MountItem::kTrolleyScale)];
    scale.value *= first->scale;
    scale.sigma *= first->scale;
  }
  return c;
}

Result<void> write_mount(const MountCalibration& c, const SiteConfig& site,
                         const std::string& site_text, const std::string& title,
                         const std::string& folder) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (auto done = write(folder + "/mount.txt", mount_text(c)); !done) return done;
  if (auto done = write(folder + "/mount.html", mount_page(c, title)); !done) return done;
  if (c.verdict == MountVerdict::kBad) return {};
  if (auto done = write_rig(c.rig, folder, kRate_Hz); !done) return done;
  SiteConfig written = site;
  apply(c, written);
  std::string text = to_yaml(written);
  if (!site_text.empty()) {
    const auto edited = with_values(site_text, "site.yaml", written);
    if (!edited) return edited.error();
    text = *edited;
  }
  if (auto done = write(folder + "/site.yaml", text); !done) return done;
  return write(folder + "/commissioning.yaml",
               to_yaml(commissioning_of(of_devices(c, site), today())));
}

}  // namespace crane
