// SPDX-License-Identifier: Apache-2.0
// The quick half of the workshop's scenes: small images, few frames, the same bounds. A scene is
// rendered by the one test that needs it.

#include <gtest/gtest.h>

#include "temp_folder.hpp"
#include "workshop.hpp"

namespace crane::accuracy {
namespace {

class WorkshopScene : public testing::TestWithParam<std::string> {};

TEST_P(WorkshopScene, HoldsItsBounds) {
  const test::TempFolder folder;
  WorkshopOptions options;
  options.quick = true;
  options.queries = 5000;
  const auto result =
      run_workshop_scene(std::string(CRANEMAP_WORKSHOP_SCENES "/") + GetParam() + ".yaml",
                         folder / "recording", options);
  ASSERT_TRUE(result) << result.error().text();
  std::string all;
  for (const std::string& what : result->short_of) all += "\n  " + what;
  std::printf("%s: rendered in %.1f s, mapped and judged in %.1f s; %zu of %zu answers CLEAR%s\n",
              GetParam().c_str(), result->render_s, result->map_s, result->outcome.clearance.clear,
              result->outcome.clearance.queries, all.c_str());
  if (const char* why = known_short(GetParam()); why != nullptr) {
    if (result->short_of.empty())
      std::printf(
          "%s is listed as short and holds: take it off the list if it does so at full size too\n",
          GetParam().c_str());
    else
      GTEST_SKIP() << "known to be short, " << why << ":" << all;
  } else {
    EXPECT_TRUE(result->short_of.empty()) << all;
  }
  EXPECT_GT(result->outcome.cells.all.solid, 0U) << "nothing was judged";
}

std::vector<std::string> names() {
  std::vector<std::string> out;
  for (const auto& file : workshop_scenes(true)) out.push_back(file.stem());
  return out;
}

INSTANTIATE_TEST_SUITE_P(Quick, WorkshopScene, testing::ValuesIn(names()),
                         [](const auto& scene) { return scene.param; });

TEST(WorkshopScenes, AreReadAndEachHasABound) {
  const auto all = workshop_scenes(false);
  EXPECT_GE(all.size(), 24U);
  EXPECT_GE(2 * names().size(), all.size()) << "half of them have a small version";
  for (const auto& file : all) {
    const auto scene = read_scene(file);
    ASSERT_TRUE(scene) << scene.error().text();
    EXPECT_EQ(scene->name, file.stem());
    std::size_t bounds = 0;
    for (const auto& limits : scene->bound.limits)
      bounds += limits.least.size() + limits.most.size();
    EXPECT_GT(bounds, 0U) << file;
    EXPECT_TRUE(scene->bound.limits[0].most.contains("wrong_clear")) << file;
  }
}

}  // namespace
}  // namespace crane::accuracy
