// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "dds/items.hpp"
#include "imaging/pixel_format.hpp"

namespace crane::dds {

// Frames and clouds as our processes hold them: the generated types of the same IDL, but with their
// images where the payload has them. Fast DDS lends only types of fixed size; these have the size
// of their camera's images, in memory and on the network (docs/decisions/0026). Accessors are those
// of the generated types; a test holds both to the same bytes.

/// One member of fixed size, read and set as in generated types.
#define CRANE_MEMBER(Type, name)    \
 public:                            \
  [[nodiscard]] Type name() const { \
    return name##_;                 \
  }                                 \
  void name(Type value) {           \
    name##_ = value;                \
  }                                 \
                                    \
 private:                           \
  Type name##_ = {}
#define CRANE_ITEMS(Type, name)                   \
 public:                                          \
  [[nodiscard]] const Items<Type>& name() const { \
    return name##_;                               \
  }                                               \
  Items<Type>& name() {                           \
    return name##_;                               \
  }                                               \
                                                  \
 private:                                         \
  Items<Type> name##_

/// What a sample has beside its members.
class InPlaceSample {
 public:
  /// Why its payload could not be read; nullptr: it could.
  [[nodiscard]] const char* broken() const { return broken_; }
  void broken(const char* why) { broken_ = why; }
  /// Where its payload's members begin; nullptr for memory of its own.
  [[nodiscard]] const std::uint8_t* body() const { return body_; }
  void body(const std::uint8_t* at) { body_ = at; }

 private:
  const char* broken_ = nullptr;
  const std::uint8_t* body_ = nullptr;
};

/// idl/v1/stereo_frame.idl
class StereoFrame : public InPlaceSample {
 public:
  static constexpr const char* kTypeName = "crane::v1::StereoFrame";
  /// Sizes for images of at most so many bytes each.
  void reserve(std::size_t image_bytes) {
    left_.point_at(nullptr, image_bytes);
    right_.point_at(nullptr, image_bytes);
  }
  static constexpr std::size_t kMost = crane::kMaxImageBytes;

  /// All members in the order of the IDL.
  template <class Archive>
  void walk(Archive& a) {
    a.number(crane_);
    a.number(encoding_);
    a.number(stream_);
    a.number(sequence_number_);
    a.number(after_);
    a.number(exposure_time_ns_);
    a.number(calibration_);
    a.number(width_);
    a.number(height_);
    a.items(left_, kMaxImageBytes);
    a.items(right_, kMaxImageBytes);
  }

  CRANE_MEMBER(std::uint32_t, crane);
  CRANE_MEMBER(std::uint32_t, encoding);
  CRANE_MEMBER(std::uint64_t, stream);
  CRANE_MEMBER(std::uint64_t, sequence_number);
  CRANE_MEMBER(std::int64_t, after);
  CRANE_MEMBER(std::int64_t, exposure_time_ns);
  CRANE_MEMBER(std::uint64_t, calibration);
  CRANE_MEMBER(std::uint32_t, width);
  CRANE_MEMBER(std::uint32_t, height);
  CRANE_ITEMS(std::uint8_t, left);
  CRANE_ITEMS(std::uint8_t, right);
};

/// idl/v1/partial_cloud.idl
class PartialCloud : public InPlaceSample {
 public:
  static constexpr const char* kTypeName = "crane::v1::PartialCloud";
  using Rotation = std::array<double, 9>;
  /// Sizes for at most so many pixels.
  void reserve(std::size_t pixels) {
    depth_.point_at(nullptr, pixels);
    confidence_.point_at(nullptr, pixels);
    colour_.point_at(nullptr, 3 * pixels);
  }
  static constexpr std::size_t kMost = kMaxImagePixels;

  template <class Archive>
  void walk(Archive& a) {
    a.number(crane_);
    a.number(has_colour_);
    a.number(stream_);
    a.number(sequence_number_);
    a.number(after_);
    a.number(exposure_time_ns_);
    a.number(frame_sent_ns_);
    a.number(calibration_);
    a.number(f_px_);
    a.number(cx_px_);
    a.number(cy_px_);
    a.number(baseline_m_);
    a.number(sigma_disparity_px_);
    for (double& r : rotation_) a.number(r);
    a.number(row_offset_px_);
    a.number(row_offset_sigma_px_);
    a.number(row_roll_rad_);
    a.number(row_roll_sigma_rad_);
    a.number(row_slope_);
    a.number(row_slope_sigma_);
    a.number(width_);
    a.number(height_);
    a.number(matched_pixels_);
    a.number(camera_dropped_);
    a.number(row_patches_);
    a.items(depth_, kMaxImagePixels);
    a.items(confidence_, kMaxImagePixels);
    a.items(colour_, kMaxImageBytes);
  }

  [[nodiscard]] const Rotation& rotation() const { return rotation_; }
  Rotation& rotation() { return rotation_; }

 private:
  Rotation rotation_ = {};

  CRANE_MEMBER(std::uint32_t, crane);
  CRANE_MEMBER(std::uint32_t, has_colour);
  CRANE_MEMBER(std::uint64_t, stream);
  CRANE_MEMBER(std::uint64_t, sequence_number);
  CRANE_MEMBER(std::int64_t, after);
  CRANE_MEMBER(std::int64_t, exposure_time_ns);
  CRANE_MEMBER(std::int64_t, frame_sent_ns);
  CRANE_MEMBER(std::uint64_t, calibration);
  CRANE_MEMBER(double, f_px);
  CRANE_MEMBER(double, cx_px);
  CRANE_MEMBER(double, cy_px);
  CRANE_MEMBER(double, baseline_m);
  CRANE_MEMBER(double, sigma_disparity_px);
  CRANE_MEMBER(double, row_offset_px);
  CRANE_MEMBER(double, row_offset_sigma_px);
  CRANE_MEMBER(double, row_roll_rad);
  CRANE_MEMBER(double, row_roll_sigma_rad);
  CRANE_MEMBER(double, row_slope);
  CRANE_MEMBER(double, row_slope_sigma);
  CRANE_MEMBER(std::uint32_t, width);
  CRANE_MEMBER(std::uint32_t, height);
  CRANE_MEMBER(std::uint32_t, matched_pixels);
  CRANE_MEMBER(std::uint32_t, camera_dropped);
  CRANE_MEMBER(std::uint32_t, row_patches);
  CRANE_ITEMS(float, depth);
  CRANE_ITEMS(std::uint8_t, confidence);
  CRANE_ITEMS(std::uint8_t, colour);
};

#undef CRANE_MEMBER
#undef CRANE_ITEMS

template <class Type>
inline constexpr bool kInPlace = std::is_base_of_v<InPlaceSample, Type>;

}  // namespace crane::dds
