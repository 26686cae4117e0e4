// SPDX-License-Identifier: Apache-2.0
#include "map_codec/octomap_file.hpp"

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <fstream>
#include <memory>
#include <sstream>

#include "base/read_file.hpp"

namespace crane {
namespace {

constexpr double kLargestCube = 100;  ///< [m] no measured ray proves more at once

Error bad(const std::string& name, const std::string& what) {
  return {ErrorCode::kBadData, name, what, "give a .bt or .ot file as OctoMap writes it"};
}

template <class Tree>
Result<OctomapFile> collect(const Tree& tree, const std::string& name) {
  OctomapFile out;
  out.voxel_m = tree.getResolution();
  for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it) {
    if (it.getSize() > kLargestCube)
      return bad(name, "says of a cube of " + std::to_string(it.getSize()) +
                           " m that all of it is the same: that is no map of a plant");
    (tree.isNodeOccupied(*it) ? out.occupied : out.free)
        .push_back({it.getX(), it.getY(), it.getZ(), it.getSize()});
  }
  return out;
}

}  // namespace

Result<OctomapFile> decode_octomap(const std::vector<std::uint8_t>& file, const std::string& name) {
  const auto header = check_octomap(file, name);
  if (!header) return header.error();
  if (header->nodes == 0) {
    OctomapFile out;
    out.voxel_m = header->voxel_m;
    out.coloured = header->id == "ColorOcTree";
    return out;
  }
  std::istringstream stream(std::string(file.begin(), file.end()));
  if (header->binary) {
    octomap::OcTree tree(0.1);
    if (!tree.readBinary(stream)) return bad(name, "is no OctoMap binary tree");
    return collect(tree, name);
  }
  const std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(stream));
  if (auto* colour = dynamic_cast<octomap::ColorOcTree*>(any.get())) {
    Result<OctomapFile> out = collect(*colour, name);
    if (out) out->coloured = true;
    return out;
  }
  if (auto* plain = dynamic_cast<octomap::OcTree*>(any.get())) return collect(*plain, name);
  return bad(name, "is no OctoMap tree of a known kind");
}

Result<OctomapFile> read_octomap(const std::string& path) {
  const auto file = read_file(path, kMaxOctomapBytes);
  if (file) return decode_octomap({file->begin(), file->end()}, path);
  return file.error().code == ErrorCode::kResource ? file.error() : bad(path, file.error().what);
}

Result<void> convert_bt_to_ot(const std::string& bt_path, const std::string& ot_path) {
  const auto file = read_file(bt_path, kMaxOctomapBytes);
  if (!file) return file.error();
  const auto header =
      check_octomap({reinterpret_cast<const std::uint8_t*>(file->data()), file->size()}, bt_path);
  if (!header) return header.error();
  std::istringstream stream(*file);
  octomap::OcTree tree(header->voxel_m);
  if (!header->binary || !tree.readBinary(stream)) return bad(bt_path, "is no OctoMap binary tree");
  std::ofstream out(ot_path, std::ios::binary);
  const bool written = tree.write(out);
  out.close();
  if (written && out) return {};
  return Error{ErrorCode::kResource, ot_path, "cannot be written",
               "check permissions and free space"};
}

}  // namespace crane
