// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/dds/topic/TopicDataType.hpp>

#include "dds/cdr_walk.hpp"
#include "dds/image_samples.hpp"

namespace crane::dds {

/// Type support of an InPlaceSample. A reader's samples point into their payloads; a writer lends
/// payloads that are as large as the images it was told of, and no larger.
///
/// Fast DDS lends what it takes for plain, and then takes the payload for the sample itself: true
/// for writers here, not for readers. So a participant either reads or writes a topic.
template <class Sample>
class InPlaceType : public eprosima::fastdds::dds::TopicDataType {
  using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;
  static constexpr std::size_t kHeader = 4;  ///< encoding and options of the payload

 public:
  enum class Role { kNone, kReader, kWriter };

  InPlaceType() {
    setName(Sample::kTypeName);
    m_isGetKeyDefined = false;
    take_role(Role::kNone, Sample::kMost);
  }
  /// For the reader or writer that is made next. False when the participant has the other one.
  /// `capacity`: of the payloads that a writer lends, see Sample::reserve().
  bool take_role(Role role, std::size_t capacity) {
    if (role_ != Role::kNone && role_ != role) return false;
    role_ = role;
    Sample largest;
    largest.reserve(capacity);
    m_typeSize = static_cast<std::uint32_t>(size_of(largest));
    return true;
  }
  /// The sample in memory that was lent by a writer of this capacity.
  static void lay_out(Sample& sample, std::size_t capacity, void* memory) {
    sample.reserve(capacity);
    auto* body = static_cast<std::uint8_t*>(memory);
    CdrWriter writer(body, true);
    sample.walk(writer);
    sample.body(body);
  }
  /// Puts its members into that memory. False: its images have shrunk, and are in memory of their
  /// own now.
  static bool complete(Sample& sample, std::size_t capacity, void* memory) {
    Sample largest;
    largest.reserve(capacity);
    if (size_of(sample) != size_of(largest)) {
      CdrOwn own;
      sample.walk(own);
      return false;
    }
    CdrWriter writer(static_cast<std::uint8_t*>(memory));
    sample.walk(writer);
    return true;
  }
  /// Bytes of its payload.
  static std::size_t size_of(Sample& sample) {
    CdrSize size;
    sample.walk(size);
    return kHeader + size.bytes();
  }

  bool serialize(void* data, Payload* payload) override {
    auto& sample = *static_cast<Sample*>(data);
    const std::size_t size = size_of(sample);
    if (size > payload->max_size) return false;
    const std::uint8_t header[kHeader] = {0, 1, 0, 0};  // CDR, little-endian
    std::memcpy(payload->data, header, kHeader);
    CdrWriter writer(payload->data + kHeader);
    sample.walk(writer);
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<std::uint32_t>(size);
    return true;
  }
  /// What is wrong with the payload is in the sample as well: Fast DDS does not ask.
  bool deserialize(Payload* payload, void* data) override {
    auto& sample = *static_cast<Sample*>(data);
    sample.reserve(0);
    sample.broken("has no known encoding");
    sample.body(nullptr);
    if (payload->length < kHeader || payload->data[0] != 0 || payload->data[1] > 1) return false;
    CdrReader reader(payload->data + kHeader, payload->length - kHeader, payload->data[1] == 0);
    sample.walk(reader);
    sample.broken(reader.flaw());
    sample.body(payload->data + kHeader);
    return reader.flaw() == nullptr;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(size_of(*static_cast<Sample*>(data))); };
  }
  void* createData() override { return new Sample(); }
  void deleteData(void* data) override { delete static_cast<Sample*>(data); }
  bool getKey(void* /*data*/, eprosima::fastrtps::rtps::InstanceHandle_t* /*handle*/,
              bool /*md5*/) override {
    return false;
  }
  [[nodiscard]] bool is_bounded() const override { return true; }
  [[nodiscard]] bool is_plain() const override { return role_ == Role::kWriter; }

 private:
  Role role_ = Role::kNone;
};

}  // namespace crane::dds
