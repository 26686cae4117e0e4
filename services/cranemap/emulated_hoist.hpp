// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "config/site_config.hpp"
#include "dds/endpoints.hpp"
#include "sim/scene.hpp"

namespace crane {

/// The controller of a scene's crane, as far as it tells of hook and load: topic hoist_state.
class EmulatedHoist {
 public:
  /// `scene` has a hoist, and began at `start` (wall time). Error: Resource.
  static Result<EmulatedHoist> create(Scene scene, const SiteConfig& site, TimeNs start);
  /// Says how it is now, if it is time to; to be called more often than the scene's rate.
  Result<void> tell();

 private:
  EmulatedHoist(Scene scene, const SiteConfig& site, TimeNs start,
                dds::Writer<dds::HoistStateTopic> writer);

  Scene scene_;
  std::uint32_t crane_;
  TimeNs start_, told_ = 0;
  std::uint64_t number_ = 0;
  dds::Writer<dds::HoistStateTopic> writer_;
};

}  // namespace crane
