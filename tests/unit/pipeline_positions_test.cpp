// SPDX-License-Identifier: Apache-2.0
// Positions that lie, and frames that find it out.

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "mapping_pipeline_fixture.hpp"

namespace crane {
namespace {

/// What a camera over a textured floor sees, wherever the positions say that it is.
class PositionsTest : public MappingPipelineTest {
 protected:
  static MapperConfig crane_config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    return c;
  }
  static double grey_at(double x_m, double y_m) {
    auto h = static_cast<std::uint64_t>(std::floor(x_m / 0.1)) * 0x9E3779B97F4A7C15ULL +
             static_cast<std::uint64_t>(std::floor(y_m / 0.1));
    h = (h ^ h >> 30U) * 0xBF58476D1CE4E5B9ULL;
    h = (h ^ h >> 27U) * 0x94D049BB133111EBULL;
    return 60 + 120 * double(h >> 40U) / double(1U << 24U);
  }
  static CloudSample seen_from(std::uint64_t number, TimeNs exposure, double true_x) {
    CloudSample c = cloud(number, exposure);
    const StereoRig& rig = the_rig();
    const Eigen::Isometry3d T = Eigen::Translation3d(true_x, 2, 0) * rig.T_map_camera_at_zero;
    for (std::uint32_t v = 0; v < c.frame.height; ++v)
      for (std::uint32_t u = 0; u < c.frame.width; ++u) {
        const Eigen::Vector3d p =
            T * Eigen::Vector3d((u - c.frame.cx_px) / c.frame.f_px * 1.95,
                                (v - c.frame.cy_px) / c.frame.f_px * 1.95, 1.95);
        for (int i = 0; i < 3; ++i) c.colour.push_back(std::uint8_t(grey_at(p.x(), p.y())));
      }
    return c;
  }
  struct Step {
    double true_x, said_x;  ///< of the cart, at the exposure
  };
  /// A frame every 0.2 s, readings every 50 ms as `said` says.
  static std::vector<std::optional<Cause>> drive(MappingPipeline& pipeline, int frames,
                                                 const std::function<double(double)>& true_x,
                                                 const std::function<double(double)>& said) {
    std::vector<std::optional<Cause>> out;
    for (int i = -4; i < 4 * frames + 4; ++i) {
      const double s = 0.05 * i;
      const TimeNs t = kT0 + i * 50 * kMs;
      pipeline.add_position(Axis::kCart, 1, t, said(s));
      pipeline.add_position(Axis::kTrolley, 1, t, 2 + 1e-4 * (i % 3));
    }
    for (int n = 0; n < frames; ++n) {
      const TimeNs t = kT0 + n * 200 * kMs;
      pipeline.add_cloud(seen_from(std::uint64_t(n), t, true_x(0.2 * n)), t);
      const auto frame = pipeline.step(t);
      EXPECT_TRUE(frame) << n;
      out.push_back(frame ? frame->refused : std::nullopt);
    }
    return out;
  }
  static int count(const std::vector<std::optional<Cause>>& all, std::optional<Cause> cause) {
    return static_cast<int>(std::count(all.begin(), all.end(), cause));
  }
};

TEST_F(PositionsTest, OfACraneThatDrivesAreBelieved) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto x = [](double s) { return 3 + 0.6 * s; };
  EXPECT_EQ(count(drive(pipeline, 15, x, x), std::nullopt), 15);
  EXPECT_EQ(pipeline.report().trust, Trust::kGood);
}

TEST_F(PositionsTest, AfterAJumpNoFrameIsUsedThatDoesNotAgreeWithWhatWasSeen) {
  for (const double off_m : {0.3, -0.5, 2.0}) {
    MappingPipeline pipeline(crane_config(), rig_);
    const auto x = [](double s) { return 3 + 0.5 * s; };
    const auto frames =
        drive(pipeline, 15, x, [&](double s) { return x(s) + (s > 1.43 ? off_m : 0); });
    EXPECT_EQ(count(frames, std::nullopt), 8) << off_m;
    EXPECT_EQ(count(frames, Cause::kPositionUnconfirmed), 7) << off_m;
    EXPECT_EQ(pipeline.report().trust, Trust::kCartJumped);
    EXPECT_NEAR(pipeline.report().jump_m, off_m, 0.05);
    EXPECT_EQ(pipeline.report().counts.of(Cause::kCartJump), 1U);
  }
}

TEST_F(PositionsTest, AJumpThatFramesConfirmIsBelieved) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto steps = [](double s) { return s < 0.7 ? 3.0 : s < 1.5 ? 4.2 : 3.4; };
  EXPECT_EQ(count(drive(pipeline, 12, steps, steps), std::nullopt), 12);
  EXPECT_EQ(pipeline.report().trust, Trust::kGood);
}

TEST_F(PositionsTest, AnInterruptedBeamCostsTheFramesBesideItAndNoMore) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto x = [](double s) { return 3 + 0.5 * s; };
  const auto frames =
      drive(pipeline, 15, x, [&](double s) { return std::abs(s - 1) < 0.12 ? 0 : x(s); });
  EXPECT_EQ(count(frames, std::nullopt), 14);
  EXPECT_EQ(count(frames, Cause::kPositionDoubtful), 1);
}

TEST_F(PositionsTest, ARangefinderAtTheFarEndIsFoundOutAndSetRightByTheConfiguration) {
  const auto x = [](double s) { return 3 + 0.6 * s; };
  const auto from_the_end = [&](double s) { return 20 - x(s); };
  MappingPipeline pipeline(crane_config(), rig_);
  const auto frames = drive(pipeline, 15, x, from_the_end);
  EXPECT_LE(count(frames, std::nullopt), 2);
  EXPECT_EQ(pipeline.report().trust, Trust::kCartReversed);
  MapperConfig config = crane_config();
  config.cart_direction = -1;
  config.cart_offset_m = 20;
  MappingPipeline right(config, rig_);
  EXPECT_EQ(count(drive(right, 15, x, from_the_end), std::nullopt), 15);
}

TEST_F(PositionsTest, AWrongDirectionIsFoundOutWhereTheCraneIsMovedStepByStepToo) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto steps = [](double s) { return 3 + 0.5 * std::fmod(std::floor(s / 0.6), 3); };
  const auto frames = drive(pipeline, 15, steps, [&](double s) { return 20 - steps(s); });
  EXPECT_EQ(pipeline.report().trust, Trust::kCartReversed);
  EXPECT_LE(count(frames, std::nullopt), 4);
}

TEST_F(PositionsTest, AnOffsetTooSmallForAJumpIsFoundByFramesAndNotTakenForAWrongDirection) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto frames = drive(
      pipeline, 15, [](double) { return 3.0; },
      [](double s) { return 3 + (s > 1 ? 0.17 : 0) + 0.001 * std::sin(50 * s); });
  EXPECT_EQ(count(frames, std::nullopt), 6);
  EXPECT_EQ(pipeline.report().trust, Trust::kContradicted);
  EXPECT_EQ(pipeline.report().counts.of(Cause::kCartJump), 0U);
}

TEST_F(PositionsTest, FramesThatAgreeAgainAreUsedAgain) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto frames = drive(
      pipeline, 20, [](double) { return 3.0; },
      [](double s) { return 3 + (s > 1 && s < 2.1 ? 0.17 : 0) + 0.001 * std::sin(50 * s); });
  EXPECT_EQ(pipeline.report().trust, Trust::kGood);
  EXPECT_EQ(count(frames, std::nullopt), 6 + 7) << "after two more that agreed";
}

TEST_F(PositionsTest, ARangefinderThatHangsIsFoundOut) {
  MappingPipeline pipeline(crane_config(), rig_);
  const auto x = [](double s) { return 3 + 0.6 * s; };
  const auto frames = drive(
      pipeline, 15, x, [&](double s) { return s > 1 ? x(1) : x(s) + 0.001 * std::sin(50 * s); });
  EXPECT_GE(count(frames, std::nullopt), 5);
  EXPECT_LE(count(frames, std::nullopt), 7) << "0.2 m further at most";
}

TEST_F(PositionsTest, ACloudOfAnotherCalibrationIsRefusedAndSaid) {
  MappingPipeline pipeline(crane_config(), rig_);
  for (TimeNs t = kT0 - 200 * kMs; t <= kT0 + 200 * kMs; t += 50 * kMs)
    for (const Axis axis : {Axis::kCart, Axis::kTrolley}) pipeline.add_position(axis, 1, t, 3);
  CloudSample other = cloud(0, kT0);
  other.calibration += 1;
  pipeline.add_cloud(std::move(other), kT0);
  EXPECT_EQ(pipeline.step(kT0)->refused, Cause::kCloudOtherCalibration);
  EXPECT_EQ(pipeline.report().refused, Cause::kCloudOtherCalibration);
  EXPECT_TRUE(pipeline.map().tiles().empty());
}

}  // namespace
}  // namespace crane
