// SPDX-License-Identifier: Apache-2.0
// Somebody else's camera by the writer library.

#include "system/camera_driver.hpp"

#include <algorithm>

#include "crane/camera/writer.hpp"

namespace crane::test {
namespace {

using camera::Encoding;
using camera::Writer;

TEST(CameraWriter, TheExampleFeedsARealStereoService) {
  driver_feeds_stereo([](std::vector<std::string> arguments, const std::string& output) {
    arguments.insert(arguments.begin(), "cranemap-example-camera-driver");
    return Process(arguments, output);
  });
}

TEST(CameraWriter, SaysWhatIsWrongAndWhatToDo) {
  const auto refused = [](std::uint32_t width, std::uint32_t height, Encoding encoding) {
    camera::Options options;
    options.width = width;
    options.height = height;
    options.encoding = encoding;
    std::string error;
    EXPECT_EQ(Writer::open(options, error), nullptr);
    return error;
  };
  EXPECT_NE(refused(0, 0, Encoding::kMono8).find("image size out of bounds"), std::string::npos);
  EXPECT_NE(refused(2448, 2049, Encoding::kMono8).find("2448 x 2048"), std::string::npos);
  EXPECT_NE(refused(0xFFFFFFFF, 0xFFFFFFFF, Encoding::kJpeg).find("out of bounds"),
            std::string::npos);
  EXPECT_NE(refused(641, 480, Encoding::kYuyv).find("odd width"), std::string::npos);
  EXPECT_NE(refused(642, 480, Encoding::kMono10p).find("end within a byte"), std::string::npos);
  EXPECT_NE(refused(640, 480, Encoding(77)).find("unknown"), std::string::npos);
  camera::Options options;
  options.width = options.height = 64;
  options.domain = 233;
  std::string error;
  EXPECT_EQ(Writer::open(options, error), nullptr);
  EXPECT_FALSE(error.empty());
}

TEST(CameraWriter, PairsArriveWithWhatWasSaidOfThem) {
  camera::Options options;
  options.domain = static_cast<std::uint32_t>(std::stoi(next_domain()));
  options.width = 64;
  options.height = 48;
  options.encoding = Encoding::kJpeg;
  options.jpeg_bytes = 1000;
  std::string error;
  const auto writer = Writer::open(options, error);
  ASSERT_NE(writer, nullptr) << error;
  dds::Settings settings;
  settings.domain = options.domain;
  auto participant = *dds::Participant::create(settings, "looks on");
  auto frames = *dds::Reader<dds::StereoFrameTopic>::create(participant, nullptr);
  ASSERT_TRUE(eventually(std::chrono::seconds(20),
                         [&] { return writer->readers() == 1 && frames.counts().matched == 1; }));
  EXPECT_FALSE(writer->publish(5, 10, 10, error)) << "nothing was lent";
  auto pair = writer->loan();
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair.bytes, 1000U);
  EXPECT_EQ(writer->loan().left, pair.left);
  EXPECT_FALSE(writer->publish(5, error)) << "without bytes";
  EXPECT_FALSE(writer->publish(5, 1001, 10, error));
  EXPECT_FALSE(writer->publish(5, 0, 10, error));
  EXPECT_FALSE(writer->publish(0, 10, 10, error));
  std::fill_n(pair.left, 10, 1);
  std::fill_n(pair.right, 20, 2);
  ASSERT_TRUE(writer->publish(5, 10, 20, error)) << error;
  writer->missed(3);
  ASSERT_TRUE(writer->loan());
  EXPECT_FALSE(writer->publish(5, 10, 20, error)) << "no later";
  ASSERT_TRUE(writer->publish(6, 1000, 1000, error)) << error;
  for (const std::uint64_t number : {0U, 4U}) {
    std::unique_ptr<dds::Received<dds::StereoFrame>> got;
    ASSERT_TRUE(
        eventually(std::chrono::seconds(20), [&] { return (got = frames.take()) != nullptr; }));
    const dds::StereoFrame& frame = **got;
    EXPECT_EQ(frame.sequence_number(), number);
    EXPECT_EQ(frame.after(), -1);
    EXPECT_EQ(frame.encoding(), 19U);
    EXPECT_EQ(frame.left().size(), number == 0 ? 10U : 1000U);
    EXPECT_EQ(frame.right().size(), number == 0 ? 20U : 1000U);
    EXPECT_TRUE(number != 0 || frame.right().back() == 2);
  }
}

}  // namespace
}  // namespace crane::test
