// SPDX-License-Identifier: Apache-2.0
// Frames and clouds with their images where the payload has them: the same bytes as the generated
// types of the same IDL, and no byte too many.

#include "dds/in_place_type.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "dds/validate.hpp"
#include "interop/samples.h"
#include "interop/set_fields.hpp"
#include "partial_cloud.h"
#include "partial_cloudPubSubTypes.h"
#include "stereo_frame.h"
#include "stereo_framePubSubTypes.h"

namespace crane::dds {
namespace {

using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
using Bytes = std::vector<std::uint8_t>;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#define FIELDS_OF(T, FIELDS)                         \
  void set(T& s) {                                   \
    FIELDS(SET_F, SET_S, SET_B, SET_A, SET_O, SET_Q) \
  }
FIELDS_OF(StereoFrame, STEREO_FRAME)
FIELDS_OF(PartialCloud, PARTIAL_CLOUD)
FIELDS_OF(v1::StereoFrame, STEREO_FRAME)
FIELDS_OF(v1::PartialCloud, PARTIAL_CLOUD)
#pragma GCC diagnostic pop

template <class Type, class Sample>
Bytes bytes_of(Type& type, Sample& sample) {
  Payload payload(type.getSerializedSizeProvider(&sample)());
  EXPECT_TRUE(type.serialize(&sample, &payload));
  return {payload.data, payload.data + payload.length};
}

template <class Ours, class Generated, class PubSubType>
struct Types {
  using Sample = Ours;
  using Other = Generated;
  using OtherType = PubSubType;
};

template <class T>
class InPlace : public ::testing::Test {};
using Both = ::testing::Types<Types<StereoFrame, v1::StereoFrame, v1::StereoFramePubSubType>,
                              Types<PartialCloud, v1::PartialCloud, v1::PartialCloudPubSubType>>;
TYPED_TEST_SUITE(InPlace, Both);

TYPED_TEST(InPlace, WritesTheBytesThatTheGeneratedTypeWrites) {
  InPlaceType<typename TypeParam::Sample> type;
  typename TypeParam::OtherType other;
  EXPECT_STREQ(type.getName(), other.getName());
  EXPECT_EQ(type.m_isGetKeyDefined, other.m_isGetKeyDefined);
  auto ours = std::make_unique<typename TypeParam::Sample>();
  auto theirs = std::make_unique<typename TypeParam::Other>();
  set(*ours);
  set(*theirs);
  EXPECT_EQ(bytes_of(type, *ours), bytes_of(other, *theirs));
}

TYPED_TEST(InPlace, ReadsWhatTheGeneratedTypeWrites) {
  InPlaceType<typename TypeParam::Sample> type;
  typename TypeParam::OtherType other;
  auto theirs = std::make_unique<typename TypeParam::Other>();
  set(*theirs);
  Bytes bytes = bytes_of(other, *theirs);
  Payload payload(static_cast<std::uint32_t>(bytes.size()));
  std::memcpy(payload.data, bytes.data(), bytes.size());
  payload.length = payload.max_size;
  auto ours = std::make_unique<typename TypeParam::Sample>();
  ASSERT_TRUE(type.deserialize(&payload, ours.get()));
  EXPECT_EQ(flaw(*ours), nullptr);
  EXPECT_EQ(bytes_of(type, *ours), bytes);
  // As every shorter one is refused, whatever the sample said before.
  for (std::uint32_t length = 0; length < payload.max_size; length += 1 + length / 50) {
    payload.length = length;
    EXPECT_FALSE(type.deserialize(&payload, ours.get()));
    EXPECT_NE(flaw(*ours), nullptr);
  }
}

TYPED_TEST(InPlace, LendsAsMuchAsItsImagesNeedAndReadsAsMuchAsTheyMayHave) {
  using Type = InPlaceType<typename TypeParam::Sample>;
  Type writer, reader;
  ASSERT_TRUE(writer.take_role(Type::Role::kWriter, 752 * 480));
  const auto bytes = writer.m_typeSize;
  EXPECT_FALSE(writer.take_role(Type::Role::kReader, 752 * 480));
  ASSERT_TRUE(writer.take_role(Type::Role::kWriter, 752 * 480 + 4));
  EXPECT_GT(writer.m_typeSize, bytes);
  EXPECT_LE(writer.m_typeSize - bytes, 4U * 8);
  EXPECT_TRUE(writer.is_plain());
  ASSERT_TRUE(reader.take_role(Type::Role::kReader, TypeParam::Sample::kMost));
  EXPECT_FALSE(reader.take_role(Type::Role::kWriter, 1));
  EXPECT_FALSE(reader.is_plain());
}

TEST(InPlaceFrame, AMonoPairOf752By480TakesWhatItHolds) {
  StereoFrame frame;
  frame.reserve(752 * 480);
  EXPECT_LE(InPlaceType<StereoFrame>::size_of(frame), 2U * 752 * 480 + 80);
}

TEST(InPlaceFrame, WhatIsLentIsThePayload) {
  InPlaceType<StereoFrame> type;
  for (const std::size_t size : {1U, 4U, 6U, 1001U}) {
    ASSERT_TRUE(type.take_role(InPlaceType<StereoFrame>::Role::kWriter, size));
    Bytes memory(type.m_typeSize, 0xAA);
    StereoFrame lent;
    InPlaceType<StereoFrame>::lay_out(lent, size, memory.data() + 4);
    ASSERT_EQ(lent.left().size(), size);
    std::fill_n(lent.left().data(), size, 1);
    std::fill_n(lent.right().data(), size, 2);
    lent.sequence_number(77);
    ASSERT_TRUE(InPlaceType<StereoFrame>::complete(lent, size, memory.data() + 4));
    StereoFrame same;
    same.sequence_number(77);
    same.left().resize(size);
    same.right().resize(size);
    std::fill_n(same.left().data(), size, 1);
    std::fill_n(same.right().data(), size, 2);
    const Bytes written = bytes_of(type, same);
    EXPECT_EQ(Bytes(memory.begin() + 4, memory.end()), Bytes(written.begin() + 4, written.end()));
    lent.right().shrink(size - 1);
    EXPECT_FALSE(InPlaceType<StereoFrame>::complete(lent, size, memory.data() + 4));
  }
}

TEST(InPlaceFrame, OtherByteOrderAndOtherEncodings) {
  InPlaceType<StereoFrame> type;
  StereoFrame frame;
  set(frame);
  Bytes bytes = bytes_of(type, frame);
  Payload payload(static_cast<std::uint32_t>(bytes.size()));
  const auto read = [&](std::uint8_t encoding) {
    std::memcpy(payload.data, bytes.data(), bytes.size());
    payload.data[1] = encoding;
    payload.length = payload.max_size;
    return type.deserialize(&payload, &frame);
  };
  EXPECT_FALSE(read(0)) << "its lengths are not those of the other byte order";
  for (const int parameters : {2, 3, 6, 7, 11})
    EXPECT_FALSE(read(static_cast<std::uint8_t>(parameters)));
  EXPECT_TRUE(read(1));
  // As a big-endian peer writes it.
  Bytes turned(4 + 56 + 4 + 2 + 2 + 4 + 3);
  turned[4 + 3] = 5;           // crane
  turned[4 + 7] = 1;           // encoding
  turned[4 + 56 - 8 + 3] = 1;  // width
  turned[4 + 56 - 4 + 3] = 2;  // height
  turned[4 + 56 + 3] = 2;      // bytes of the left image
  turned[4 + 56 + 4] = 11;
  turned[4 + 56 + 8 + 3] = 3;
  turned[4 + 56 + 12] = 22;
  Payload big(static_cast<std::uint32_t>(turned.size()));
  std::memcpy(big.data, turned.data(), turned.size());
  big.length = big.max_size;
  ASSERT_TRUE(type.deserialize(&big, &frame)) << frame.broken();
  EXPECT_EQ(frame.crane(), 5U);
  EXPECT_EQ(frame.height(), 2U);
  EXPECT_EQ(frame.left().size(), 2U);
  EXPECT_EQ(frame.left()[0], 11);
  EXPECT_EQ(frame.right()[0], 22);
}

}  // namespace
}  // namespace crane::dds
