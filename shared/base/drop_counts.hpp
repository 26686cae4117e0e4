// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace crane {

/// Why something was not used, or was worth counting. One list for all services; the numbers are
/// published (service_status) and stay as they are.
enum class Cause : std::uint32_t {
  // What a reader did not hand on: broke its contract, or lost by Fast DDS.
  kFrameInvalid = 1,
  kFrameLost = 2,
  kCloudInvalid = 3,
  kCloudLost = 4,
  kPositionInvalid = 5,
  kPositionLost = 6,
  kHoistInvalid = 7,
  kHoistLost = 8,
  kTileRequestInvalid = 9,
  kTileRequestLost = 10,
  kZoneCommandInvalid = 11,
  kZoneCommandLost = 12,
  kRequestInvalid = 13,
  kRequestLost = 14,
  kMalformedDatagram = 15,
  kNotAcceptedByDds = 16,
  // Players.
  kSkippedAfterRestart = 20,
  kSentAgain = 21,
  kImageUnreadable = 22,
  kColourDiffers = 23,
  kNoFrameMemory = 24,
  kDeviceGaveNoDistance = 25,
  kBeyondDeviceRange = 26,
  // Live rangefinders.
  kDeviceFault = 27,
  kDeviceSilent = 28,
  kTelegramDamaged = 29,
  kReadingsWaited = 66,
  // Frames at the stereo service.
  kSecondCamera = 30,
  kFrameMisfit = 31,
  kFrameOverwritten = 32,
  kNoCloudMemory = 33,
  kFrameUnmatched = 34,
  kFrameMissing = 35,
  kPairTellsNothing = 36,
  kTooNear = 37,
  kFrameOtherCalibration = 38,
  kAmbiguous = 39,
  // What PairCheck finds: 40 and PairFlaw.
  kLeftBlack = 40,
  kRightBlack = 41,
  kLeftSaturated = 42,
  kRightSaturated = 43,
  kLeftFrozen = 44,
  kRightFrozen = 45,
  kNoOverlap = 46,
  kTooDark = 47,
  kNoContrast = 48,
  kTooNoisy = 49,
  // Readings of the rangefinders at the mapper.
  kCartFailed = 50,
  kCartNotFinite = 51,
  kCartOutOfRange = 52,
  kCartJump = 53,
  kCartStuck = 54,
  kCartSecondSource = 55,
  kTrolleyFailed = 60,
  kTrolleyNotFinite = 61,
  kTrolleyOutOfRange = 62,
  kTrolleyJump = 63,
  kTrolleyStuck = 64,
  kTrolleySecondSource = 65,
  // Clouds at the mapper.
  kCloudSecondCamera = 80,
  kCloudOverwritten = 81,
  kCloudOtherCalibration = 82,
  kCloudMisfit = 83,
  kCloudTooEarly = 84,
  kCloudQueueFull = 85,
  kCloudMissing = 86,
  kPositionNone = 87,
  kPositionGap = 88,
  kPositionDoubtful = 89,
  kPositionUnconfirmed = 90,
  kContradictsMap = 91,
  kNoMatch = 92,
  kIntegrationFailed = 93,
  kPointsOutsideHeights = 94,
  kMapMemory = 95,
  kPaperPoints = 96,
  kMapFull = 97,
  kEarlierFrameMisplaced = 79,
  kWatchdogWrong = 98,
  kImageContradicts = 99,
  // Hook and load.
  kHoistFailed = 100,
  kLoadTooLarge = 101,
  kHoistUnknown = 102,
  kHoistPixels = 103,
  kHoistOfAnotherTime = 104,
  kHoistSecondSource = 105,
  // The map on its way.
  kTilesSentAgain = 110,
  kTileRequestTooSoon = 111,
  kOctreeTooLarge = 112,
  kStatusNotAccepted = 113,
  kStateNotSaved = 114,
  kZoneCommandRefused = 115,
  kZonesTooMany = 116,
  // Clearance, mirror.
  kNoAnswerMapInvalid = 130,
  kNoAnswerBadQuery = 131,
  kOctreeRefused = 132,
  kTooManyRequests = 133,
  // What every service meets.
  kHttpRefused = 150,
  kHttpClosed = 151,
  kLogLeftOut = 152,
  // Live cameras.
  kCameraLost = 170,
  kCameraMissedFrame = 171,
  kFrameOvertaken = 172,
  kPairIncomplete = 173,
  kExposureNotLater = 174,
  kCameraClockSet = 175,
  kFrameShort = 176,
  kFrameCorrupt = 177,
  kHalvesSwapped = 178,
  kPacketsLost = 179,
  kNoCaptureTime = 180,
  // Recorder.
  kRecordTooSlow = 186,
  kRecordNoRoom = 187,
  kRecordOtherTime = 188,
  kRecordUnplaced = 189,
};

/// As it is published and read by people: at most 63 characters. Never empty.
std::string_view cause_text(Cause cause);
/// The cause of a published number, if this version knows it.
std::optional<Cause> cause_of(std::uint32_t number);

/// Counts by cause. Small: copied as it is. One thread.
class DropCounts {
 public:
  void add(Cause cause, std::uint64_t by = 1) { counts_[index(cause)] += by; }
  /// For what is counted elsewhere, since the start.
  void set(Cause cause, std::uint64_t value) { counts_[index(cause)] = value; }
  [[nodiscard]] std::uint64_t of(Cause cause) const { return counts_[index(cause)]; }
  /// Takes over what `other`, which counts other causes, has.
  void merge(const DropCounts& other) {
    for (std::size_t i = 0; i < counts_.size(); ++i)
      if (other.counts_[i] > 0) counts_[i] = other.counts_[i];
  }
  /// Calls fn(cause, count) for each that is not zero.
  template <class Fn>
  void for_each(Fn fn) const {
    for (std::size_t i = 0; i < counts_.size(); ++i)
      if (counts_[i] > 0) fn(static_cast<Cause>(i), counts_[i]);
  }

 private:
  static std::size_t index(Cause cause) { return static_cast<std::size_t>(cause); }
  std::array<std::uint64_t, 192> counts_{};
};

}  // namespace crane
