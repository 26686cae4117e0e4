// SPDX-License-Identifier: Apache-2.0
// Voxels and the left image.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "gateway/foxglove_json.hpp"
#include "gateway/foxglove_messages.hpp"
#include "imaging/convert.hpp"

namespace crane::gateway::foxglove {
namespace {

enum : char { kUnknown, kFree, kOccupied };

/// In voxels: low corner and edge.
struct Cube {
  std::int64_t low[3];
  std::int64_t edge;
};

Cube in_voxels(const MapCube& c, double voxel_m) {
  const auto low = [&](double middle) { return std::llround((middle - c.size_m / 2) / voxel_m); };
  return {{low(c.x_m), low(c.y_m), low(c.z_m)}, std::llround(c.size_m / voxel_m)};
}

/// Cells of n x n x n voxels around all that is known.
class Cells {
 public:
  Cells(const OctomapFile& map, std::size_t most) : voxel_m_(map.voxel_m) {
    for (int axis = 0; axis < 3; ++axis) low_[axis] = INT64_MAX, high_[axis] = INT64_MIN;
    for (const auto* cubes : {&map.occupied, &map.free})
      for (const MapCube& one : *cubes) {
        const Cube c = in_voxels(one, voxel_m_);
        for (int axis = 0; axis < 3; ++axis) {
          low_[axis] = std::min(low_[axis], c.low[axis]);
          high_[axis] = std::max(high_[axis], c.low[axis] + c.edge);
        }
      }
    while (double(size(0)) * double(size(1)) * double(size(2)) > double(most)) ++n_;
    known_.resize(std::size_t(size(0) * size(1) * size(2)));
    free_.resize(known_.size());
  }

  void occupy(const MapCube& cube) {
    each(cube, [this](std::size_t at, std::int64_t) { known_[at] = kOccupied; });
  }
  /// All of a cell has to be freed.
  void free(const MapCube& cube) {
    each(cube, [this](std::size_t at, std::int64_t voxels) {
      free_[at] += static_cast<std::uint32_t>(voxels);
      if (known_[at] == kUnknown && free_[at] == n_ * n_ * n_) known_[at] = kFree;
    });
  }

  [[nodiscard]] std::int64_t size(int axis) const {
    return (high_[axis] - low_[axis] + n_ - 1) / n_;
  }
  [[nodiscard]] double cell_m() const { return double(n_) * voxel_m_; }
  [[nodiscard]] Eigen::Vector3d origin() const {
    return voxel_m_ * Eigen::Vector3d(double(low_[0]), double(low_[1]), double(low_[2]));
  }
  [[nodiscard]] const std::string& bytes() const { return known_; }

 private:
  /// `visit(cell, voxels of the cube in it)`.
  template <class Visit>
  void each(const MapCube& cube, const Visit& visit) const {
    const Cube c = in_voxels(cube, voxel_m_);
    std::int64_t from[3], to[3];
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = c.low[axis] - low_[axis];
      to[axis] = from[axis] + c.edge;
    }
    const auto within = [&](int axis, std::int64_t cell) {
      return std::min(to[axis], (cell + 1) * n_) - std::max(from[axis], cell * n_);
    };
    for (std::int64_t z = from[2] / n_; z * n_ < to[2]; ++z)
      for (std::int64_t y = from[1] / n_; y * n_ < to[1]; ++y)
        for (std::int64_t x = from[0] / n_; x * n_ < to[0]; ++x)
          visit(std::size_t((z * size(1) + y) * size(0) + x),
                within(0, x) * within(1, y) * within(2, z));
  }

  double voxel_m_;
  std::int64_t low_[3], high_[3], n_ = 1;
  std::string known_;
  std::vector<std::uint32_t> free_;
};

}  // namespace

Result<std::string> voxel_grid(const OctomapFile& map, TimeNs time, std::size_t most) {
  if (map.occupied.empty() || !(map.voxel_m > 0))
    return Error{ErrorCode::kNotAvailable, "the map", "has no surface yet", ""};
  Cells cells(map, most);
  for (const MapCube& cube : map.occupied) cells.occupy(cube);
  for (const MapCube& cube : map.free) cells.free(cube);
  const double edge = cells.cell_m();
  const std::int64_t columns = cells.size(0), rows = cells.size(1);
  return with_data({{"timestamp", stamp(time)},
                    {"frame_id", "map"},
                    {"pose", pose_at(cells.origin())},
                    {"row_count", rows},
                    {"column_count", columns},
                    {"cell_size", xyz({edge, edge, edge})},
                    {"slice_stride", rows * columns},
                    {"row_stride", columns},
                    {"cell_stride", 1},
                    {"fields", Json::array({field("occupancy", 0, kUint8)})}},
                   cells.bytes());
}

Result<std::string> left_image(const dds::StereoFrame& frame, int most_px) {
  const auto format = pixel_format(frame.encoding());
  if (!format) return Error{ErrorCode::kBadData, "stereo_frame", "unknown encoding", ""};
  auto image = to_image(
      {*format, frame.width(), frame.height(), {frame.left().data(), frame.left().size()}});
  if (!image) return image.error();
  try {
    cv::Mat pixels(int(frame.height()), int(frame.width()), CV_8UC(int(image->channels)),
                   image->bytes.data());
    if (const double scale = double(most_px) / pixels.cols; scale < 1)
      cv::resize(pixels, pixels, {}, scale, scale, cv::INTER_AREA);
    std::vector<unsigned char> jpeg;
    if (!cv::imencode(".jpg", pixels, jpeg))
      return Error{ErrorCode::kBadData, "stereo_frame", "cannot be shown", ""};
    return with_data({{"timestamp", stamp(frame.exposure_time_ns())},
                      {"frame_id", "camera"},
                      {"format", "jpeg"}},
                     std::string(jpeg.begin(), jpeg.end()));
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, "stereo_frame", e.what(), ""};
  }
}

}  // namespace crane::gateway::foxglove
