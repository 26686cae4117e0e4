// SPDX-License-Identifier: Apache-2.0
// Who may include whom, from one table. The order is that of the layers in shared/CMakeLists.txt.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace crane {
namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

struct Layer {
  Names folders;    ///< of shared/ whose headers it may include, beside its own
  Names libraries;  ///< third-party headers, by the key of kLibraries
};

/// Third-party headers by how their include lines begin.
const std::map<std::string, std::string> kLibraries = {
    {"opencv", "opencv2/"}, {"pcl", "pcl/"},         {"octomap", "octomap/"},
    {"yaml", "yaml-cpp/"},  {"fastdds", "fastdds/"}, {"fastrtps", "fastrtps/"},
    {"embree", "embree3/"}, {"zstd", "zstd.h"},      {"eigen", "Eigen/"},
    {"cli", "CLI/"},        {"json", "nlohmann/"},   {"hwy", "hwy/"},
    {"boost", "boost/"},    {"systemd", "systemd/"}, {"openssl", "openssl/"},
    {"jpeg", "jpeglib.h"},  {"modbus", "modbus/"},   {"ceres", "ceres/"},
    {"aravis", "arv.h"},    {"gstreamer", "gst/"},   {"tinyxml", "tinyxml2.h"},
};

const std::map<std::string, Layer> kLayers = {
    {"shared/base", {{}, {"json"}}},
    {"shared/network", {{}, {}}},
    {"shared/http", {{"base"}, {"boost", "openssl"}}},
    {"shared/geometry", {{"base"}, {"eigen"}}},
    {"shared/config", {{"base", "geometry"}, {"yaml"}}},
    {"shared/imaging", {{"base"}, {"opencv", "jpeg"}}},
    {"shared/recording", {{"base", "geometry", "config", "imaging"}, {"eigen", "opencv"}}},
    {"shared/calibration_files",
     {{"base", "geometry", "config", "recording"}, {"eigen", "opencv", "yaml", "tinyxml"}}},
    {"shared/calibration",
     {{"base", "geometry", "imaging", "recording"}, {"eigen", "opencv", "ceres", "openssl"}}},
    {"shared/sensors",
     {{"base", "geometry", "config", "imaging", "recording"}, {"modbus", "aravis", "gstreamer"}}},
    {"shared/sim", {{"base", "geometry", "config", "recording"}, {"eigen", "embree"}}},
    {"shared/stereo", {{"base", "geometry", "imaging"}, {"eigen", "opencv", "hwy"}}},
    {"shared/mount",
     {{"base", "geometry", "config", "imaging", "recording", "calibration", "stereo"},
      {"eigen", "opencv", "ceres"}}},
    {"shared/cloud", {{"base", "geometry"}, {"eigen", "pcl"}}},
    {"shared/motion", {{"base", "geometry", "cloud"}, {"eigen", "hwy"}}},
    {"shared/mapping", {{"base", "geometry", "cloud"}, {"eigen", "hwy"}}},
    {"shared/watchdog", {{"base", "geometry", "cloud", "motion"}, {"eigen"}}},
    {"shared/map_codec", {{"base", "cloud", "mapping"}, {"zstd", "octomap"}}},
    {"shared/mapping_pipeline",
     {{"base", "geometry", "config", "cloud", "motion", "mapping", "watchdog", "map_codec"},
      {"eigen"}}},
    {"shared/rtps_guard", {{}, {}}},
    {"shared/dds",
     {{"base", "geometry", "imaging", "rtps_guard"}, {"fastdds", "fastrtps", "openssl"}}},
    {"shared/camera_writer", {{"base", "dds", "imaging"}, {}}},
    {"shared/service", {{"base", "http", "config", "dds", "client"}, {"cli", "systemd"}}},
    {"shared/map_sync", {{"base", "dds", "map_codec"}, {}}},
    {"shared/client", {{"base", "geometry", "dds", "map_codec", "map_sync"}, {}}},
    {"shared/evaluation",
     {{"base", "geometry", "recording", "mapping", "map_codec", "client"}, {}}},
    // A service may use any of shared/, never another service.
    {"services",
     {{"base",
       "geometry",
       "config",
       "imaging",
       "recording",
       "calibration",
       "sensors",
       "sim",
       "stereo",
       "mount",
       "cloud",
       "motion",
       "mapping",
       "watchdog",
       "map_codec",
       "mapping_pipeline",
       "dds",
       "map_sync",
       "service",
       "client",
       "evaluation",
       "http",
       "calibration_files"},
      {"cli", "json", "opencv"}}},
};

struct Include {
  std::string file, target;
  bool quoted = false;
};

std::vector<Include> includes_below(const fs::path& folder) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (extension != ".hpp" && extension != ".cpp") continue;
    std::ifstream file(entry.path());
    std::string line;
    for (std::smatch m; std::getline(file, line);)
      if (std::regex_search(line, m, kInclude)) out.push_back({entry.path(), m[2], m[1] == "\""});
  }
  return out;
}

const fs::path kSource = CRANEMAP_SOURCE_DIR;

TEST(IncludeLayers, EveryFolderOfSharedIsInTheTable) {
  for (const auto& entry : fs::directory_iterator(kSource / "shared"))
    if (entry.is_directory())
      EXPECT_TRUE(kLayers.contains("shared/" + entry.path().filename().string())) << entry.path();
}

TEST(IncludeLayers, NothingIncludesALayerAboveItOrALibraryThatIsNotItsOwn) {
  std::size_t seen = 0;
  for (const auto& [folder, layer] : kLayers)
    for (const Include& include : includes_below(kSource / folder)) {
      ++seen;
      for (const auto& [library, start] : kLibraries)
        if (include.target.starts_with(start))
          EXPECT_TRUE(layer.libraries.contains(library))
              << include.file << " includes " << include.target;
      const std::string first = include.target.substr(0, include.target.find('/'));
      const bool ours = include.quoted && kLayers.contains("shared/" + first);
      if (ours && folder != "shared/" + first)
        EXPECT_TRUE(layer.folders.contains(first))
            << include.file << " includes " << include.target;
    }
  EXPECT_GT(seen, 300U);
}

/// Code for wide instructions must not share inline functions with code for every processor: the
/// linker keeps one of them for both (and PCL's and Eigen's allocators then do not fit each other).
TEST(IncludeLayers, FilesWithWideInstructionsIncludeOnlyTheirOwnHeaderAndTheCLibrary) {
  std::map<std::string, std::vector<std::string>> includes;
  for (const Include& include : includes_below(kSource / "shared"))
    includes[include.file].push_back(include.target);
  const Names allowed = {"hwy/foreach_target.h",
                         "hwy/highway.h",
                         "base/simd_targets.hpp",
                         "cstdlib",
                         "cstdint",
                         "cstddef"};
  std::size_t wide = 0;
  for (const auto& [file, targets] : includes) {
    if (std::find(targets.begin(), targets.end(), "hwy/highway.h") == targets.end()) continue;
    ++wide;
    const std::string own =
        fs::path(file).parent_path().filename() / fs::path(file).stem().concat(".hpp");
    for (const std::string& target : targets)
      EXPECT_TRUE(allowed.contains(target) || target == own) << file << " includes " << target;
    for (const std::string& target : includes[(kSource / "shared" / own).string()])
      EXPECT_TRUE(allowed.contains(target)) << own << " includes " << target;
  }
  EXPECT_EQ(wide, 7U);
}

TEST(IncludeLayers, NoServiceIncludesAnother) {
  for (const auto& service : fs::directory_iterator(kSource / "services")) {
    if (!service.is_directory()) continue;
    for (const Include& include : includes_below(service.path())) {
      const std::string first = include.target.substr(0, include.target.find('/'));
      if (include.quoted && include.target.find('/') != std::string::npos &&
          fs::is_directory(kSource / "services" / first) &&
          !fs::is_directory(kSource / "shared" / first))
        EXPECT_EQ(first, service.path().filename()) << include.file;
    }
  }
}

TEST(IncludeLayers, ThirdPartyHeadersStayOutOfPublicHeaders) {
  // Where a library may appear in a header: its home, and there only in headers named here.
  const Names allowed = {"participant_impl.hpp",
                         "guarded_type.hpp",
                         "writer_impl.hpp",
                         "guarded_transport.hpp",
                         "signed_file.hpp",
                         "capture_time.hpp",
                         "pipeline_error.hpp",
                         "in_place_type.hpp",
                         "rectification.hpp",
                         "stream.hpp",
                         "session.hpp",
                         "tls_context.hpp",
                         "json.hpp"};
  for (const auto& [folder, layer] : kLayers)
    for (const Include& include : includes_below(kSource / folder)) {
      if (!include.file.ends_with(".hpp") || allowed.contains(fs::path(include.file).filename()))
        continue;
      for (const auto& [library, start] : kLibraries)
        if (library != "eigen")
          EXPECT_FALSE(include.target.starts_with(start))
              << include.file << " includes " << include.target;
    }
}

TEST(IncludeLayers, TheClientsPublicHeadersIncludeOnlyTheStandardLibraryAndEachOther) {
  const fs::path headers = kSource / "shared/client/include";
  const fs::path network = kSource / "shared/network/include";
  for (const fs::path& part : {headers, network})
    for (const Include& include : includes_below(part)) {
      const bool standard =
          !include.quoted && include.target.find_first_of("/.") == std::string::npos;
      EXPECT_TRUE(standard || fs::exists(headers / include.target) ||
                  fs::exists(network / include.target))
          << include.file << " includes " << include.target;
    }
}

/// Where the call that opens at `open` ends, and its last argument.
std::string last_argument(const std::string& text, std::size_t open) {
  int depth = 0;
  std::size_t from = open + 1;
  for (std::size_t i = open; i < text.size(); ++i) {
    if (text[i] == '(' || text[i] == '{' || text[i] == '[') ++depth;
    if (text[i] == ')' || text[i] == '}' || text[i] == ']') --depth;
    if (text[i] == ',' && depth == 1) from = i + 1;
    if (depth > 0) continue;
    const std::string argument = text.substr(from, i - from);
    const std::size_t first = argument.find_first_not_of(" \n");
    return first == std::string::npos ? "" : argument.substr(first);
  }
  return "";
}

// What throws where a folder may not be entered ends a service that could have said so.
TEST(FileSystem, IsAskedWithoutExceptions) {
  static const std::regex kCall(
      R"(\b(fs|std::filesystem)::(exists|is_[a-z_]+|file_size|create_[a-z_]+|remove|remove_all|copy|)"
      R"(copy_file|rename|canonical|absolute|current_path|read_symlink|last_write_time|space|status|)"
      R"(symlink_status|equivalent|permissions|resize_file)\()");
  static const std::regex kLoop(
      R"(for \([^;]*: *(fs|std::filesystem)::(recursive_)?directory_iter)");
  const std::set<std::string> given = {"failed", "ignored", "none", "unreadable"};
  std::size_t calls = 0;
  for (const char* part : {"shared", "services"})
    for (const auto& entry : fs::recursive_directory_iterator(kSource / part)) {
      const std::string extension = entry.path().extension();
      if (extension != ".hpp" && extension != ".cpp") continue;
      std::ifstream file(entry.path());
      const std::string text((std::istreambuf_iterator<char>(file)), {});
      EXPECT_FALSE(std::regex_search(text, kLoop)) << entry.path();
      for (std::sregex_iterator m(text.begin(), text.end(), kCall), end; m != end; ++m, ++calls) {
        const auto open = static_cast<std::size_t>(m->position() + m->length() - 1);
        const bool of_a_status = m->str().find("::is_") != std::string::npos &&
                                 text.compare(open + 1, 18, "fs::symlink_status") == 0;
        EXPECT_TRUE(of_a_status || given.contains(last_argument(text, open)))
            << entry.path() << ": " << m->str() << " throws";
      }
    }
  EXPECT_GT(calls, 20U);
}

}  // namespace
}  // namespace crane
