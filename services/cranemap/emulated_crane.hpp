// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "child_process.hpp"
#include "config/site_config.hpp"
#include "emulated_hoist.hpp"

namespace crane {

struct EmulatedCraneOptions {
  std::string from;            ///< recording (folder) or scene
  std::string folder;          ///< gets site.yaml, calibration, devices, pictures
  double rate_hz = 1;          ///< pairs a second of a scene; 0 = the scene's
  double speed_mps = 0;        ///< of a scene's crane; 0 = the scene's
  bool one_round = false;      ///< of a scene: the camera ends when it has been everywhere
  bool pictures_kept = false;  ///< else they are deleted once read
};

/// A whole crane without hardware: a camera whose software writes files, a rangefinder of the cart
/// and another make's of the trolley on pseudo-terminals, each a process of its own, all on one
/// trajectory and one clock; of a scene with hook and load this process tells hoist_state, as its
/// controller would. Real services connect to it by the site configuration that it gives.
class EmulatedCrane {
 public:
  /// Writes calibration (cam0, cam1, rig.yaml) and site.yaml, which is `base` with camera and
  /// rangefinders. `with_truth`: of a scene also truth/, as 'cranemap simulate' does.
  /// Error: Configuration, of the scene, the recording or a folder that is not empty; Resource.
  static Result<EmulatedCrane> prepare(const EmulatedCraneOptions& options, SiteConfig base,
                                       bool with_truth);

  [[nodiscard]] const SiteConfig& site() const { return site_; }
  /// Pairs that one round has; 0: there is no end.
  [[nodiscard]] std::size_t pairs() const { return pairs_; }

  /// `start_at`: wall time of the first instant, for all three. Rangefinders measure before.
  Result<void> start_rangefinders(TimeNs start_at);
  Result<void> start_camera(TimeNs start_at);
  /// To be called at least ten times a second. Error: one of them ended with a failure.
  Result<void> watch();
  [[nodiscard]] bool camera_ended() const { return camera_ended_; }
  void stop();

 private:
  struct Part {
    std::string name;
    ChildProcess process;
    bool ended = false;
  };
  Result<void> start(const std::string& name, std::vector<std::string> arguments);

  EmulatedCraneOptions options_;
  SiteConfig site_;
  bool is_scene_ = false, camera_ended_ = false;
  std::size_t pairs_ = 0;
  std::optional<Scene> with_hoist_;
  std::optional<EmulatedHoist> hoist_;
  std::vector<Part> parts_;
};

}  // namespace crane
