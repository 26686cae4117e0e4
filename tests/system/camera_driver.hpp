// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>

#include "dds/endpoints.hpp"
#include "imaging/convert.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "system/process.hpp"
#include "temp_folder.hpp"

namespace crane::test {

/// The first pair of the rig's recording in grey, as left.pgm and right.pgm.
inline void write_pgm_pair(const TempFolder& folder) {
  const auto recording = Recording::open(rig_recording());
  ASSERT_TRUE(recording);
  const RecordedFrame& frame = recording->frames()[0];
  for (const bool left : {true, false}) {
    const auto image = read_image(left ? frame.left_file : frame.right_file, kMaxImagePixels);
    ASSERT_TRUE(image);
    std::vector<std::uint8_t> grey;
    ASSERT_TRUE(to_grey(image->view(), grey));
    std::ofstream file(folder / (left ? "left.pgm" : "right.pgm"), std::ios::binary);
    file << "P5\n" << image->width << " " << image->height << "\n255\n";
    file.write(reinterpret_cast<const char*>(grey.data()), std::streamsize(grey.size()));
  }
}

/// Somebody's camera driver `start(arguments)` beside a stereo service of ours: its pairs become
/// clouds, none is lost, and they say when they were exposed.
template <class Start>
void driver_feeds_stereo(const Start& start) {
  const TempFolder folder;
  ASSERT_NO_FATAL_FAILURE(write_pgm_pair(folder));
  const std::string domain = next_domain();
  std::ofstream(folder / "site.yaml") << "dds: {domain: " << domain << "}\nhttp: {port: 0}\n";
  Process stereo(
      {"cranemap-stereo", "--config", folder / "site.yaml", "--calibration", rig_recording()},
      folder / "stereo.txt");
  dds::Settings settings;
  settings.domain = static_cast<std::uint32_t>(std::stoi(domain));
  auto participant = *dds::Participant::create(settings, "looks on");
  auto clouds = *dds::Reader<dds::PartialCloudTopic>::create(participant, nullptr);
  ASSERT_TRUE(eventually(std::chrono::seconds(30), [&] { return clouds.counts().matched == 1; }))
      << stereo.output();
  const TimeNs before = SystemClock().now();
  Process driver =
      start({folder / "left.pgm", folder / "right.pgm", domain}, folder / "driver.txt");
  std::vector<std::uint64_t> numbers;
  std::uint32_t best = 0;
  EXPECT_TRUE(eventually(std::chrono::seconds(40),
                         [&] {
                           while (const auto cloud = clouds.take()) {
                             numbers.push_back((*cloud)->sequence_number());
                             EXPECT_EQ((*cloud)->width(), 1280U);
                             best = std::max(best, (*cloud)->matched_pixels());
                             EXPECT_GT((*cloud)->exposure_time_ns(), before);
                             EXPECT_LE((*cloud)->exposure_time_ns(), (*cloud)->frame_sent_ns());
                           }
                           return numbers.size() >= 5;
                         }))
      << driver.output() << stereo.output();
  // Of a still only the first: then the camera is frozen, as it should be said.
  EXPECT_GT(best, 400'000U);
  for (std::size_t i = 1; i < numbers.size(); ++i) EXPECT_GT(numbers[i], numbers[i - 1]);
  for (Process* p : {&driver, &stereo}) p->signal(SIGTERM);
  EXPECT_EQ(stereo.wait(20), 0) << stereo.output();
  driver.wait(20);
}

}  // namespace crane::test
