// SPDX-License-Identifier: Apache-2.0
// What is written about the configuration is what its descriptions say.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "config/reference.hpp"
#include "config/site_config.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
const fs::path kSource = CRANEMAP_SOURCE_DIR;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Configuration, TheReferencePageIsWhatTheDescriptionsGive) {
  EXPECT_EQ(text_of(kSource / "docs/configuration.md"), reference_page())
      << "make it anew: build/release/bin/cranemap config reference > docs/configuration.md";
}

/// Of "`mapper.voxel_m`" and "`dds.network: plant`" in our pages, what begins with a section.
TEST(Configuration, PagesNameOnlyKeysThatThereAre) {
  std::set<std::string> keys;
  std::string sections;
  for (const KeyRow& row : all_keys()) {
    const std::string path = std::regex_replace(row.path, std::regex(R"(\[\])"), "");
    keys.insert(path);
    if (row.is_section && path.find('.') == std::string::npos)
      sections += (sections.empty() ? "" : "|") + path;
  }
  const std::regex kNamed("`((" + sections + R"()\.[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?)[`:])");
  const std::set<std::string> kFiles = {"cpp", "hpp", "yaml", "md", "bt", "ot"};
  std::vector<fs::path> pages = {kSource / "README.md"};
  for (const char* part : {"docs", "deploy", "services", "shared"})
    for (const auto& entry : fs::recursive_directory_iterator(kSource / part))
      if (entry.path().extension() == ".md") pages.push_back(entry.path());
  std::size_t named = 0;
  for (const fs::path& page : pages) {
    const std::string text = text_of(page);
    for (std::sregex_iterator m(text.begin(), text.end(), kNamed), end; m != end; ++m) {
      const std::string key = (*m)[1];
      if (kFiles.contains(key.substr(key.rfind('.') + 1))) continue;
      ++named;
      EXPECT_TRUE(keys.contains(key)) << page << " names `" << key << "`";
    }
  }
  EXPECT_GT(named, 20U);
}

TEST(Configuration, SiteFilesOfDeployAreRead) {
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kSource / "deploy")) {
    if (!entry.is_regular_file()) continue;
    const std::string text = text_of(entry.path());
    const bool is_site = text.starts_with("crane: ") || text.find("\ncrane: ") != std::string::npos;
    if (entry.path().extension() != ".yaml" || !is_site) continue;
    ++files;
    const auto site = read_site_config(entry.path());
    EXPECT_TRUE(site) << site.error().text();
  }
  EXPECT_GE(files, 6U);
}

}  // namespace
}  // namespace crane
