// SPDX-License-Identifier: Apache-2.0
#pragma once

// For whoever has a stereo camera that cranemap does not know: pairs of images as topic
// stereo_frame. Needs the C++17 standard library only.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "crane/network.hpp"

namespace crane::camera {

/// How bytes say pixels: ENCODING_* of idl/v1/bounds.idl, by number.
enum class Encoding : std::uint32_t {
  kMono8 = 1,
  kBgr8 = 2,
  kRgb8 = 3,
  kYuyv = 4,        ///< Y U Y V; width even
  kBayerRggb8 = 5,  ///< the first two pixels of the first two rows
  kBayerGrbg8 = 6,
  kBayerGbrg8 = 7,
  kBayerBggr8 = 8,
  kMono10p = 9,  ///< GenICam's: values one after the other from the low bits on; width % 4 == 0
  kMono12p = 10,
  kBayerRggb10p = 11,
  kBayerGrbg10p = 12,
  kBayerGbrg10p = 13,
  kBayerBggr10p = 14,
  kBayerRggb12p = 15,
  kBayerGrbg12p = 16,
  kBayerGbrg12p = 17,
  kBayerBggr12p = 18,
  kJpeg = 19,  ///< a whole JPEG file an image
};

/// Of which crane, where on the network, and what the camera gives. `identity`: "camera" unless
/// another one is named.
struct Options : NetworkSettings {
  std::uint32_t crane = 1;
  std::uint32_t width = 0, height = 0;  ///< of each image [px], at most 2448 x 2048 pixels
  Encoding encoding = Encoding::kMono8;
  std::size_t jpeg_bytes = 0;  ///< of JPEG: the largest image; 0 = a byte a pixel
};

/// Where the images of one exposure go: rows from the top without padding.
struct Pair {
  std::uint8_t* left = nullptr;
  std::uint8_t* right = nullptr;
  std::size_t bytes = 0;  ///< of each
  explicit operator bool() const { return left != nullptr; }
};

/// One connected camera: one stream of frames, numbered from 0. A camera that is connected anew is
/// a new Writer. One thread; nothing is thrown.
class Writer {
 public:
  /// nullptr, and what is wrong and what to do about it.
  static std::unique_ptr<Writer> open(const Options& options, std::string& error) noexcept;
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Memory to be filled, that of the sample itself; the same until it is published. Nothing while
  /// readers hold all there is: leave the frame out and say missed(1).
  Pair loan() noexcept;
  /// Publishes what was lent and filled. `exposure_time_ns`: middle of the exposure, nanoseconds
  /// since the Unix epoch, by the clock that the rangefinders have. False, and why.
  bool publish(std::int64_t exposure_time_ns, std::string& error) noexcept;
  /// Of JPEG: so many bytes of each image count.
  bool publish(std::int64_t exposure_time_ns, std::size_t left_bytes, std::size_t right_bytes,
               std::string& error) noexcept;
  /// Frames that the camera took and that are not published: their numbers are left out, and
  /// receivers count them as lost.
  void missed(std::uint64_t frames) noexcept;
  /// Readers of stereo_frame now: cranemap-stereo is one.
  [[nodiscard]] int readers() const noexcept;

 private:
  struct Impl;
  explicit Writer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::camera
