// SPDX-License-Identifier: Apache-2.0
#include "calibration/image_pairs.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <map>

#include "base/read_file.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& path) {
  std::string extension = path.extension();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

/// Images of a folder whose names begin with `prefix`, by the rest of the name without extension.
std::map<std::string, std::string> images(const fs::path& folder, const std::string& prefix) {
  std::map<std::string, std::string> out;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    std::string stem = at->path().stem();
    if (!is_image(at->path()) || !stem.starts_with(prefix)) continue;
    stem.erase(0, prefix.size());
    while (!stem.empty() && (stem[0] == '_' || stem[0] == '-')) stem.erase(0, 1);
    out[stem] = at->path();
  }
  return out;
}

}  // namespace

Result<std::vector<ImagePair>> find_image_pairs(const std::string& folder) {
  const auto there = is_folder(folder);
  if (!there) return there.error();
  const fs::path at(folder);
  for (const auto& [left_folder, right_folder, left_prefix, right_prefix] :
       {std::tuple{at, at, "left", "right"}, std::tuple{at / "left", at / "right", "", ""},
        std::tuple{at / "cam0/data", at / "cam1/data", "", ""},
        std::tuple{at / "cam0", at / "cam1", "", ""}}) {
    const auto left = images(left_folder, left_prefix);
    const auto right = images(right_folder, right_prefix);
    if (left.empty() && right.empty()) continue;
    std::map<std::string, ImagePair> pairs;
    for (const auto& [name, path] : left) pairs[name].left = path;
    for (const auto& [name, path] : right) pairs[name].right = path;
    std::vector<ImagePair> out;
    for (auto& [name, pair] : pairs) {
      pair.name = name;
      out.push_back(std::move(pair));
    }
    return out;
  }
  return Error{ErrorCode::kConfiguration, folder,
               *there ? "holds no image pairs" : "no such folder",
               "give a folder with left01.png, right01.png, ... (also left/ and right/, or cam0/ "
               "and cam1/ of a recording)"};
}

}  // namespace crane
