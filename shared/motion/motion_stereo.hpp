// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/threads.hpp"
#include "motion/bars.hpp"
#include "motion/cell_proof.hpp"
#include "motion/pattern_cells.hpp"

namespace crane {

struct MotionReport {
  std::size_t views = 0;      ///< earlier frames that were compared
  std::size_t misplaced = 0;  ///< that do not lie where their positions say
  std::size_t cells = 0;      ///< looked at
  std::size_t put_off = 0;    ///< not looked at for lack of time
  std::size_t proven = 0;     ///< pixels that got a depth
  std::size_t refined = 0;    ///< pixels whose depth got better
  BarReport bars;             ///< along the baseline
  PatternReport patterns;     ///< what the pair matched at one of several depths that fit
};

/// The crane's own motion as a second eye: what the pair left without a match is looked for in
/// earlier frames. One depth that is clearly best, borne out pixel by pixel in three views at
/// least, is a match; otherwise there is none.
class MotionStereo {
 public:
  /// `threads`: 0 = the machine's, at most 4; the result is the same for any number.
  explicit MotionStereo(int threads = 0)
      : threads_(threads_or_default(threads)),
        keys_(KeyFrameSettings{}),
        patterns_(threads_),
        bars_(threads_) {}

  /// `depth_m`, `confidence`: those of `frame`, which is placed and checked; in place. Where the
  /// pair's baseline is short for the height, its depths get finer and frame.sigma_disparity_px
  /// with them. The number of cells looked at follows the time since the last frame: some
  /// milliseconds at 10 Hz, and the rest in the next frames. Without colour, or at the first place,
  /// nothing changes.
  /// `ambiguous_m`: depths that the pair found on patterns that repeat, one of several that fit;
  /// empty, or a pixel each, 0 = none.
  MotionReport improve(DepthFrame& frame, TimeNs exposure, std::span<float> depth_m,
                       std::span<std::uint8_t> confidence, std::span<const float> ambiguous_m = {});
  void begin_anew() { keys_.clear(); }

 private:
  void look_at_cells(const DepthFrame& frame, const PlacedImage& image, const ViewSet& set,
                     std::size_t most, MotionReport& report);
  /// Where the pair's baseline is short.
  void sharpen(DepthFrame& frame, const PlacedImage& image, const ViewSet& set,
               std::span<float> depth_m, std::span<std::uint8_t> confidence, MotionReport& report);
  void fill(const DepthFrame& frame, std::span<float> depth_m, std::span<std::uint8_t> confidence,
            MotionReport& report);

  int threads_;
  KeyFrames keys_;
  PatternCells patterns_;
  Bars bars_;
  int columns_ = 0, rows_ = 0, next_row_ = 0, next_sharp_ = 0;
  TimeNs last_ = 0;
  Eigen::Vector3d last_place_ = Eigen::Vector3d::Constant(1e9);
  std::vector<std::uint8_t> wanted_;  ///< what is done with each cell
  std::vector<float> inverse_;        ///< of pixels [1/m]
  std::vector<float> sigma_;          ///< likewise
  std::vector<Borne> borne_;
};

}  // namespace crane
