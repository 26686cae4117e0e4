// SPDX-License-Identifier: Apache-2.0
// Somebody else's camera on somebody else's DDS, by the example that is in the manual.

#include "cyclone.hpp"
#include "system/camera_driver.hpp"

namespace crane::test {
namespace {

TEST(CycloneCamera, TheExampleInCFeedsARealStereoService) {
  driver_feeds_stereo([](const std::vector<std::string>& arguments, const std::string& output) {
    return cyclone("cyclone_camera_driver", arguments, output);
  });
}

}  // namespace
}  // namespace crane::test
