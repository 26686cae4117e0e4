// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/position_trust.hpp"

#include <cmath>
#include <utility>

namespace crane {
namespace {

/// So far cart and trolley move until a frame is compared closely with what was seen before.
constexpr double kCloseLook_m = 0.3;
/// So many frames in a row that contradict the map, and positions are not believed any more until
/// frames agree with it again.
constexpr int kContradictionsToDistrust = 3, kAgreementsToTrust = 3;
/// From so far back on it can be told that an axis went the other way, and how exactly. What jumps
/// while the axis stands still lies half as far back, and farther than this it counts as a jump.
constexpr double kReversed_m = 0.5, kExactly_m = 0.15;

}  // namespace

PositionTrust::Finding PositionTrust::check(const DepthFrame& frame, TimeNs exposure,
                                            const Gantry::Place& place) {
  using Verdict = PlacementCheck::Verdict;
  const bool confirmed = place.known == PositionTrack::Lookup::kFound;
  const Eigen::Vector2d moved_m = place.map_m - looked_closely_at_m_;
  const bool closely = !confirmed || contradictions_ > 0 || moved_m.norm() > kCloseLook_m;
  const PlacementCheck::Finding found = placement_.compare(frame, exposure, closely);
  const bool distrusted = trust_ != Trust::kGood;
  if (found.verdict != Verdict::kAgrees) {
    agreements_ = 0;
    if (found.verdict == Verdict::kContradicts)
      note_contradiction(moved_m, found.shift_m, confirmed);
    if (!confirmed) return {Cause::kPositionUnconfirmed, found.shift_m};
    if (found.verdict == Verdict::kContradicts || distrusted)
      return {Cause::kContradictsMap, found.shift_m};
  } else if (distrusted) {
    // A wrong direction fits wherever the crane comes back to; only who set it can right it.
    const bool for_good = trust_ != Trust::kContradicted;
    if (for_good || ++agreements_ < kAgreementsToTrust)
      return {Cause::kContradictsMap, found.shift_m};
    trust_ = Trust::kGood;
  }
  contradictions_ = 0;
  if (closely) looked_closely_at_m_ = place.map_m;
  placement_.remember();
  return {};
}

void PositionTrust::note_contradiction(const Eigen::Vector2d& moved_m,
                                       const Eigen::Vector2d& shift_m, bool confirmed) {
  if (confirmed && ++contradictions_ >= kContradictionsToDistrust && trust_ == Trust::kGood)
    trust_ = Trust::kContradicted;
  for (const Axis axis : {Axis::kCart, Axis::kTrolley})
    if (reversed(static_cast<Eigen::Index>(axis), moved_m, shift_m, confirmed))
      trust_ = axis == Axis::kCart ? Trust::kCartReversed : Trust::kTrolleyReversed;
}

/// `moved_m`: since the frame that is compared with, as positions say. Had an axis gone the other
/// way, what the frame sees would lie twice that far back. Positions that jumped can do that once
/// by chance, but not from two places.
bool PositionTrust::reversed(Eigen::Index axis, const Eigen::Vector2d& moved_m,
                             const Eigen::Vector2d& shift_m, bool confirmed) {
  const double back_m = -2 * moved_m[axis];
  if (std::abs(back_m) < kReversed_m || std::abs(shift_m[axis] - back_m) > kExactly_m) return false;
  const Eigen::Vector2d from_m = looked_closely_at_m_;
  const auto before = std::exchange(reversed_before_, Reversal{from_m, moved_m});
  return confirmed || (before && ((before->from_m - from_m).norm() > kCloseLook_m ||
                                  (before->moved_m - moved_m).norm() > kCloseLook_m));
}

}  // namespace crane
