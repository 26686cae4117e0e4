// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "base/drop_counts.hpp"
#include "mapping_pipeline/gantry.hpp"
#include "mapping_pipeline/placement_check.hpp"

namespace crane {

/// What keeps frames out of the map at present.
enum class Trust {
  kGood,
  kCartJumped,     ///< and no frame has confirmed the new positions yet
  kTrolleyJumped,  ///< likewise
  kContradicted,   ///< frames see what was seen elsewhere before
  kCartReversed,   ///< they do just as if the cart went the other way
  kTrolleyReversed,
};

/// Whether frames bear out the positions they are placed by (decision 15): a frame that fits
/// clearly better elsewhere is not used; one whose positions jumped only if it agrees. One thread.
class PositionTrust {
 public:
  explicit PositionTrust(double cell_m) : placement_(cell_m) {}

  struct Finding {
    std::optional<Cause> refused;  ///< nothing: the frame may be used, and its positions are right
    Eigen::Vector2d fits_better_m = Eigen::Vector2d::Zero();  ///< kContradictsMap: so much further
  };
  /// `frame` is placed at `place`.
  Finding check(const DepthFrame& frame, TimeNs exposure, const Gantry::Place& place);

  /// What frames say of positions: kGood, kContradicted or a reversed axis.
  [[nodiscard]] Trust trust() const { return trust_; }
  /// Frames to come are of other times: they are not compared with those before.
  void begin_anew() { placement_.clear(); }

 private:
  void note_contradiction(const Eigen::Vector2d& moved_m, const Eigen::Vector2d& shift_m,
                          bool confirmed);
  bool reversed(Eigen::Index axis, const Eigen::Vector2d& moved_m, const Eigen::Vector2d& shift_m,
                bool confirmed);

  PlacementCheck placement_;
  Eigen::Vector2d looked_closely_at_m_ = Eigen::Vector2d::Zero();
  int contradictions_ = 0, agreements_ = 0;  ///< in a row
  Trust trust_ = Trust::kGood;
  struct Reversal {
    Eigen::Vector2d from_m, moved_m;
  };
  std::optional<Reversal> reversed_before_;
};

}  // namespace crane
