// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "sensors/camera/frame_source.hpp"

namespace crane {

/// How one picture of a camera carries both images.
enum class PairLayout {
  kSideBySideYuyv,  ///< left | right, YUYV: luma is what was measured at each pixel
  kSideBySideGrey,  ///< left | right, 8 bits a pixel
  kInterleavedY8I,  ///< left and right byte by byte (RealSense)
  kSideBySideJpeg,  ///< left | right, one JPEG picture a frame
};

/// Bytes of one frame of both images, width x height pixels each; nothing for JPEG, whose frames
/// differ.
std::optional<std::size_t> frame_bytes(PairLayout layout, std::uint32_t width,
                                       std::uint32_t height);

/// Puts the left and the right image of one frame into `out`, mono for all but colour JPEG. Without
/// a right buffer the frame is one image of `width` x `height`.
/// `row_bytes` of the frame as the driver says it; 0: without padding. Size and format go to
/// `facts`. Error: WrongSize, BadData for a frame that is not `width` x `height` twice.
Result<void> split_pair(PairLayout layout, const std::uint8_t* frame, std::size_t bytes,
                        std::uint32_t width, std::uint32_t height, std::size_t row_bytes,
                        const std::string& name, const FrameBuffers& out, FrameFacts& facts);

/// Rows, counted from the bottom, that equal the row above byte for byte, of one image. Where USB
/// packets are lost cameras repeat a row. Rows of one grey are not counted: black and white ones
/// may be true.
std::uint32_t repeated_rows(const std::uint8_t* image, std::uint32_t width, std::uint32_t height,
                            std::uint32_t channels);

/// Whether the images are surely the other way round: what a camera below which there is something
/// sees on the left lies further right in the left image. Compared at a sixteenth of the size,
/// whole images shifted against each other, rows and all; false where that tells nothing.
bool halves_swapped(const std::uint8_t* left, const std::uint8_t* right, std::uint32_t width,
                    std::uint32_t height, std::uint32_t channels);

}  // namespace crane
