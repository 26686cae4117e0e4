// SPDX-License-Identifier: Apache-2.0
// The live map, saved as it is now.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "cloud/pcl_filters.hpp"
#include "map_codec/octomap_file.hpp"
#include "recording/image_file.hpp"
#include "recording/truth.hpp"
#include "system/live_services.hpp"

namespace crane::test {
namespace {

namespace fs = std::filesystem;

TEST(Snapshot, SavesTheLiveMapForEveryViewerWithWhereTheCraneIs) {
  const TempFolder folder;
  const std::string domain = next_domain(), out = folder / "now";
  const std::list<Process> services = live_services(folder, domain, "2");
  const Finished taken = run({"snapshot", "--config", folder / "site.yaml", "--calibration",
                              rig_recording(), "--out", out, "--wait", "60"},
                             folder.path());
  ASSERT_EQ(taken.code, 0) << taken.output;
  const auto bt = read_octomap(out + "/map.bt");
  const auto ot = read_octomap(out + "/map.ot");
  ASSERT_TRUE(bt && ot);
  EXPECT_GT(bt->occupied.size(), 100U);
  EXPECT_EQ(ot->occupied.size(), bt->occupied.size());
  EXPECT_EQ(ot->free.size(), bt->free.size());
  const auto cloud = read_pcd(out + "/map.pcd");
  ASSERT_TRUE(cloud) << cloud.error().text();
  EXPECT_GE(cloud->size(), bt->occupied.size());
  EXPECT_TRUE(read_height_map(out + "/height_map.png"));
  for (const char* picture : {"/map_view.png", "/map_ages.png"}) {
    const auto image = read_image(out + picture, 100'000'000);
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_GT(image->width, 500U);
  }
  EXPECT_GT(fs::file_size(out + "/map.ply"), 1000U);
  std::ifstream file(out + "/snapshot.yaml");
  std::ostringstream facts;
  facts << file.rdbuf();
  EXPECT_NE(facts.str().find("valid: true\ncomplete: true\n"), std::string::npos) << facts.str();
  EXPECT_NE(facts.str().find("cart_m: "), std::string::npos) << facts.str();
  const Finished over =
      run({"snapshot", "--config", folder / "site.yaml", "--out", out}, folder.path());
  EXPECT_EQ(over.code, 2);
  EXPECT_NE(over.output.find("nothing was changed"), std::string::npos) << over.output;
}

TEST(Snapshot, RefusesWhereThereIsNoMap) {
  const TempFolder folder;
  const Finished none =
      run({"snapshot", "--domain", next_domain(), "--out", folder / "now", "--wait", "1"},
          folder.path());
  EXPECT_EQ(none.code, 3) << none.output;
  EXPECT_NE(none.output.find("no mapper was heard within 1 s"), std::string::npos) << none.output;
  EXPECT_FALSE(fs::exists(folder / "now"));
}

}  // namespace
}  // namespace crane::test
