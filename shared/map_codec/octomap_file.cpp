#include "map_codec/octomap_file.hpp"

#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>

#include <filesystem>
#include <memory>

namespace crane {
namespace {

template <class Tree>
OctomapFile collect(const Tree& tree) {
  OctomapFile out;
  out.voxel_m = tree.getResolution();
  for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it) {
    if (tree.isNodeOccupied(*it))
      out.occupied.push_back({it.getX(), it.getY(), it.getZ(), it.getSize()});
    else
      ++out.free_leaves;
  }
  return out;
}

}  // namespace

Result<OctomapFile> read_octomap(const std::string& path) {
  const auto bad = [&path](const char* what) {
    return Error{ErrorCode::kBadData, path, what, "give a .bt or .ot file as OctoMap writes it"};
  };
  if (!std::filesystem::is_regular_file(path)) return bad("no such file");
  if (path.ends_with(".bt")) {
    octomap::OcTree tree(0.1);
    if (!tree.readBinary(path)) return bad("is no OctoMap binary tree");
    return collect(tree);
  }
  const std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(path));
  if (auto* colour = dynamic_cast<octomap::ColorOcTree*>(any.get())) {
    OctomapFile out = collect(*colour);
    out.coloured = true;
    return out;
  }
  if (auto* plain = dynamic_cast<octomap::OcTree*>(any.get())) return collect(*plain);
  return bad("is no OctoMap tree of a known kind");
}

}  // namespace crane
