// SPDX-License-Identifier: Apache-2.0
#include "base/drop_counts.hpp"

#include <algorithm>
#include <iterator>

#include "base/expects.hpp"

namespace crane {
namespace {

struct Row {
  Cause cause;
  std::string_view text;
};

constexpr Row kTable[] = {
    {Cause::kFrameInvalid, "frame broke its contract"},
    {Cause::kFrameLost, "frame lost or rejected by Fast DDS"},
    {Cause::kCloudInvalid, "cloud broke its contract"},
    {Cause::kCloudLost, "cloud lost or rejected by Fast DDS"},
    {Cause::kPositionInvalid, "position broke its contract"},
    {Cause::kPositionLost, "position lost or rejected by Fast DDS"},
    {Cause::kHoistInvalid, "hoist_state broke its contract"},
    {Cause::kHoistLost, "hoist_state lost or rejected by Fast DDS"},
    {Cause::kTileRequestInvalid, "tile_request broke its contract"},
    {Cause::kTileRequestLost, "tile_request lost or rejected by Fast DDS"},
    {Cause::kZoneCommandInvalid, "zone_command broke its contract"},
    {Cause::kZoneCommandLost, "zone_command lost or rejected by Fast DDS"},
    {Cause::kRequestInvalid, "request broke its contract"},
    {Cause::kRequestLost, "request lost or rejected by Fast DDS"},
    {Cause::kMalformedDatagram, "malformed datagram"},
    {Cause::kNotAcceptedByDds, "not accepted by DDS"},
    {Cause::kSkippedAfterRestart, "skipped after a restart"},
    {Cause::kSentAgain, "sent again"},
    {Cause::kImageUnreadable, "image unreadable or of wrong size"},
    {Cause::kColourDiffers, "left and right differ in colour"},
    {Cause::kNoFrameMemory, "no free frame memory"},
    {Cause::kDeviceGaveNoDistance, "device gave no distance"},
    {Cause::kBeyondDeviceRange, "beyond the device's range"},
    {Cause::kDeviceFault, "device reports a fault"},
    {Cause::kDeviceSilent, "device silent or unplugged"},
    {Cause::kTelegramDamaged, "telegram damaged"},
    {Cause::kReadingsWaited, "readings came faster than they could be published"},
    {Cause::kSecondCamera, "frame of a second camera"},
    {Cause::kFrameMisfit, "frame does not fit the calibration"},
    {Cause::kFrameOverwritten, "frame overwritten while it was read"},
    {Cause::kNoCloudMemory, "no free cloud memory"},
    {Cause::kFrameUnmatched, "frame could not be matched"},
    {Cause::kFrameMissing, "frame never arrived"},
    {Cause::kPairTellsNothing, "pair tells nothing"},
    {Cause::kLeftBlack, "left image black"},
    {Cause::kRightBlack, "right image black"},
    {Cause::kLeftSaturated, "left image saturated"},
    {Cause::kRightSaturated, "right image saturated"},
    {Cause::kLeftFrozen, "left image frozen"},
    {Cause::kRightFrozen, "right image frozen"},
    {Cause::kNoOverlap, "hardly a pixel matches"},
    {Cause::kTooDark, "too dark"},
    {Cause::kNoContrast, "without contrast"},
    {Cause::kTooNoisy, "too noisy"},
    {Cause::kTooNear, "frame with something nearer than the search"},
    {Cause::kAmbiguous, "pixels on patterns that repeat along the rows"},
    {Cause::kFrameOtherCalibration, "frame of another calibration"},
    {Cause::kCartFailed, "cart reading failed"},
    {Cause::kCartNotFinite, "cart reading not finite"},
    {Cause::kCartOutOfRange, "cart reading out of range"},
    {Cause::kCartJump, "cart reading jumped farther than a cart can move"},
    {Cause::kCartStuck, "cart reading stands still although the cart moved"},
    {Cause::kCartSecondSource, "cart reading of a second rangefinder"},
    {Cause::kTrolleyFailed, "trolley reading failed"},
    {Cause::kTrolleyNotFinite, "trolley reading not finite"},
    {Cause::kTrolleyOutOfRange, "trolley reading out of range"},
    {Cause::kTrolleyJump, "trolley reading jumped farther than a trolley can move"},
    {Cause::kTrolleyStuck, "trolley reading stands still although it moved"},
    {Cause::kTrolleySecondSource, "trolley reading of a second rangefinder"},
    {Cause::kCloudSecondCamera, "cloud of a second camera"},
    {Cause::kCloudOverwritten, "cloud overwritten before it was read"},
    {Cause::kCloudOtherCalibration, "cloud of another calibration"},
    {Cause::kCloudMisfit, "cloud does not fit the calibration"},
    {Cause::kCloudTooEarly, "came before an earlier cloud: is sent again"},
    {Cause::kCloudQueueFull, "cloud queue full"},
    {Cause::kCloudMissing, "cloud never arrived"},
    {Cause::kPositionNone, "no position: none arrived after the exposure"},
    {Cause::kPositionGap, "no position: gap around the exposure"},
    {Cause::kPositionDoubtful, "no position: a reading beside the exposure is doubtful"},
    {Cause::kPositionUnconfirmed, "no position: jumped, and nothing seen confirms it"},
    {Cause::kContradictsMap, "frame contradicts the map: its position must be wrong"},
    {Cause::kNoMatch, "cloud without a single match"},
    {Cause::kIntegrationFailed, "frame could not be integrated"},
    {Cause::kPointsOutsideHeights, "points outside z_min..z_max"},
    {Cause::kMapMemory, "blocks beyond max_memory_mib"},
    {Cause::kMapFull, "frame not used: the map has reached max_memory_mib"},
    {Cause::kEarlierFrameMisplaced, "earlier frame not compared: does not lie as positions say"},
    {Cause::kWatchdogWrong, "frame not used: calibration or positions are wrong"},
    {Cause::kImageContradicts, "frame not used: its image lies elsewhere than its position"},
    {Cause::kPaperPoints, "paper: point limit reached"},
    {Cause::kHoistFailed, "hoist_state says failed"},
    {Cause::kLoadTooLarge, "hoist_state: load larger than hoist.largest_load_m"},
    {Cause::kHoistUnknown, "frame without hoist_state: cut out widely"},
    {Cause::kHoistSecondSource, "hoist_state of a second controller ignored"},
    {Cause::kHoistOfAnotherTime, "hoist_state of another time than the exposures: cut out widely"},
    {Cause::kHoistPixels, "pixels of hook, rope and load"},
    {Cause::kTilesSentAgain, "tiles sent again on request"},
    {Cause::kTileRequestTooSoon, "tile_request too soon after another"},
    {Cause::kOctreeTooLarge, "octree larger than its bound"},
    {Cause::kStatusNotAccepted, "map_status not accepted by DDS"},
    {Cause::kStateNotSaved, "state not saved"},
    {Cause::kZoneCommandRefused, "zone_command refused or not saved"},
    {Cause::kZonesTooMany, "zone beyond 64 given up"},
    {Cause::kNoAnswerMapInvalid, "no answer: the map is not valid or not complete"},
    {Cause::kNoAnswerBadQuery, "no answer: bad query"},
    {Cause::kOctreeRefused, "octree_map refused"},
    {Cause::kTooManyRequests, "clearance requests of a client beyond those that may wait"},
    {Cause::kHttpRefused, "HTTP request refused"},
    {Cause::kHttpClosed, "HTTP connection closed: too slow, or one too many"},
    {Cause::kLogLeftOut, "line of the log left out: a flood, or nobody reads"},
    {Cause::kCameraLost, "camera lost, connected again"},
    {Cause::kCameraMissedFrame, "numbered by the camera, never given"},
    {Cause::kFrameOvertaken, "a newer frame was there already"},
    {Cause::kPairIncomplete, "image without its other"},
    {Cause::kExposureNotLater, "exposed no later than the frame before"},
    {Cause::kCameraClockSet, "camera's clock was set back, new stream"},
    {Cause::kFrameShort, "frame shorter than the camera's mode"},
    {Cause::kFrameCorrupt, "frame with damaged or repeated rows"},
    {Cause::kHalvesSwapped, "left and right swapped"},
    {Cause::kPacketsLost, "frame with packets lost on the network"},
    {Cause::kNoCaptureTime, "frame without the time of its exposure"},
    {Cause::kRecordTooSlow, "disk or processor too slow to record it"},
    {Cause::kRecordNoRoom, "could not be written to the recording"},
    {Cause::kRecordOtherTime, "no later than the one before, or of another hour"},
    {Cause::kRecordUnplaced, "frame before the first positions"},
};

const Row* find(Cause cause) {
  const auto row = std::find_if(std::begin(kTable), std::end(kTable),
                                [cause](const Row& r) { return r.cause == cause; });
  return row == std::end(kTable) ? nullptr : row;
}

}  // namespace

std::string_view cause_text(Cause cause) {
  const Row* row = find(cause);
  expects(row != nullptr, "every cause has a text");
  return row->text;
}

std::optional<Cause> cause_of(std::uint32_t number) {
  const Row* row = find(static_cast<Cause>(number));
  return row == nullptr ? std::nullopt : std::optional(row->cause);
}

}  // namespace crane
