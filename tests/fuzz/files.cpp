// SPDX-License-Identifier: Apache-2.0
// The small files beside a recording, its truth, and scenes: whatever stands in one of them, the
// others being sound. The first byte chooses the file.
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "recording/calibration.hpp"
#include "recording/truth.hpp"
#include "sim/scene.hpp"

namespace {

/// A folder with a sound calibration and truth, removed at the end.
class Folder {
 public:
  Folder() {
    char name[] = "/tmp/cranemap_fuzz_XXXXXX";
    if (mkdtemp(name) == nullptr) std::abort();
    path_ = name;
    crane::StereoRig rig;
    rig.left = rig.right = {1280, 720, 800, 800, 640, 360};
    rig.T_left_right.translation().x() = 0.12;
    rig.T_map_camera_at_zero.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
    rig.T_map_camera_at_zero.translation().z() = 2.5;
    crane::HeightMap heights;
    heights.cell_m = 0.01;
    heights.columns = heights.rows = 4;
    heights.height_mm.assign(16, 7);
    if (!crane::write_rig(rig, path_, 10) ||
        !crane::write_height_map(path_ + "/height_map.png", heights) || !crane::read_rig(path_) ||
        !crane::read_height_map(path_ + "/height_map.png"))
      std::abort();
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  /// Runs `read` with this content in a file of the folder, and puts back what was there.
  template <class Read>
  void with(const std::string& name, const std::string& content, const Read& read) const {
    const std::string file = path_ + "/" + name;
    std::ifstream before(file, std::ios::binary);
    const std::string sound((std::istreambuf_iterator<char>(before)), {});
    put(file, content);
    read();
    put(file, sound);
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  /// A new file: to cut an old one off and write it again has ext4 wait for the disk.
  static void put(const std::string& file, const std::string& content) {
    std::remove(file.c_str());
    std::ofstream(file, std::ios::binary) << content;
  }

  std::string path_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string& path = folder.path();
  switch (data[0] % 8) {
    case 0:
      folder.with("cam0/sensor.yaml", text, [&] { (void)crane::read_rig(path); });
      break;
    case 1:
      folder.with("rig.yaml", text, [&] { (void)crane::read_rig(path); });
      break;
    case 2:
      folder.with("range.yaml", text, [&] { (void)crane::read_rangefinder(path + "/range.yaml"); });
      break;
    case 3:
      folder.with("height_map.yaml", text,
                  [&] { (void)crane::read_height_map(path + "/height_map.png"); });
      break;
    case 4:
      folder.with("height_map.png", text,
                  [&] { (void)crane::read_height_map(path + "/height_map.png"); });
      break;
    case 5:
      folder.with("obstacles.yaml", text,
                  [&] { (void)crane::read_obstacles(path + "/obstacles.yaml"); });
      break;
    default:
      folder.with("scene.yaml", text, [&] { (void)crane::read_scene(path + "/scene.yaml"); });
  }
  return 0;
}
