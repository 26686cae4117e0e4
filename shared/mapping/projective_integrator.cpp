#include "mapping/projective_integrator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crane {
namespace {

/// Share of a cell's pixels that must have a match before its rays clear anything.
constexpr double kMinMatchedShare = 0.5;
/// Share of the pixels a level voxel face covers that must hit a voxel before it is believed.
constexpr double kMinHitShare = 0.06;
constexpr std::uint32_t kNoiseRatio = 3;
constexpr float kNoDepth = std::numeric_limits<float>::infinity();

double mean_depth(const DepthFrame& f) {
  double sum = 0;
  std::uint64_t n = 0;
  for (std::size_t i = 0; i < std::size_t(f.width) * f.height; i += 97)
    if (f.depth_m[i] > 0) sum += f.depth_m[i], ++n;
  return n > 0 ? sum / double(n) : 0;
}

}  // namespace

IntegrationReport ProjectiveIntegrator::integrate(const DepthFrame& frame, TimeNs time,
                                                  OccupancyMap& map) {
  IntegrationReport report;
  mean_depth_m_ = mean_depth(frame);
  if (!(mean_depth_m_ > 0)) return report;  // nothing matched: no evidence
  const double voxel_px = map.voxel_m() * frame.f_px / mean_depth_m_;
  // About 3 x 3 samples on the face of a voxel are enough for its mean height.
  stride_px_ = std::clamp(static_cast<int>(voxel_px / 3), 1, 8);
  const double samples = voxel_px * voxel_px / (stride_px_ * stride_px_);
  min_points_ = static_cast<std::uint32_t>(std::max(1.0, std::round(kMinHitShare * samples)));
  gather_hits(frame, map, report);
  build_nearest(frame, std::clamp(static_cast<int>(voxel_px / 2), 1, 32));
  carve_free(frame, map, report);
  apply_hits(time, map, report);
  return report;
}

void ProjectiveIntegrator::gather_hits(const DepthFrame& f, const OccupancyMap& map,
                                       IntegrationReport& report) {
  hits_.clear();
  const Eigen::Matrix3f R = f.T_map_rectified.linear().cast<float>();
  const Eigen::Vector3d t = f.T_map_rectified.translation();
  const auto inverse_f = static_cast<float>(1 / f.f_px);
  const double inverse_voxel = 1 / map.voxel_m();
  const auto step = static_cast<std::uint32_t>(stride_px_);
  for (std::uint32_t v = step / 2; v < f.height; v += step)
    for (std::uint32_t u = step / 2; u < f.width; u += step) {
      const std::size_t i = std::size_t(v) * f.width + u;
      const float depth = f.depth_m[i];
      if (!(depth > 0)) continue;
      const Eigen::Vector3f p_rectified((float(u) - float(f.cx_px)) * inverse_f * depth,
                                        (float(v) - float(f.cy_px)) * inverse_f * depth, depth);
      const Eigen::Vector3d p_map = (R * p_rectified).cast<double>() + t;
      if (p_map.z() < settings_.z_min_m || p_map.z() > settings_.z_max_m) {
        ++report.out_of_range;
        continue;
      }
      HitTable::Hit& hit = hits_.at(static_cast<int>(std::floor(p_map.x() * inverse_voxel)),
                                    static_cast<int>(std::floor(p_map.y() * inverse_voxel)),
                                    static_cast<int>(std::floor(p_map.z() * inverse_voxel)));
      ++hit.count;
      hit.height_sum_m += static_cast<float>(p_map.z());
      if (f.colour != nullptr) {
        hit.b_sum += f.colour[3 * i];
        hit.g_sum += f.colour[3 * i + 1];
        hit.r_sum += f.colour[3 * i + 2];
      }
      ++report.points;
    }
}

void ProjectiveIntegrator::build_nearest(const DepthFrame& f, int cell_px) {
  cell_px_ = cell_px;
  cells_x_ = static_cast<int>(f.width) / cell_px;
  cells_y_ = static_cast<int>(f.height) / cell_px;
  const std::size_t cells = std::size_t(cells_x_) * std::size_t(cells_y_);
  nearest_.assign(cells, 0);
  row_minimum_.resize(cells);
  free_depth_.resize(cells);
  farthest_m_ = 0;
  const int wanted = std::max(1, static_cast<int>(kMinMatchedShare * cell_px * cell_px));
  for (int cy = 0; cy < cells_y_; ++cy)
    for (int cx = 0; cx < cells_x_; ++cx) {
      float low = kNoDepth;
      float high = 0;
      int matched = 0;
      for (int dy = 0; dy < cell_px; ++dy) {
        const float* row =
            f.depth_m + (std::size_t(cy) * cell_px + dy) * f.width + std::size_t(cx) * cell_px;
        for (int dx = 0; dx < cell_px; ++dx)
          if (row[dx] > 0) low = std::min(low, row[dx]), high = std::max(high, row[dx]), ++matched;
      }
      if (matched < wanted) continue;
      nearest_[std::size_t(cy) * cells_x_ + cx] = low;
      farthest_m_ = std::max(farthest_m_, high);
    }
  // The nearest of 3 x 3 cells, less two sigma: a voxel covers more than one cell, and what is
  // claimed free must be free at the nearest plausible depth. Empty neighbours do not count.
  const auto low_of = [](float a, float b) { return a > 0 && (b <= 0 || a < b) ? a : b; };
  for (int cy = 0; cy < cells_y_; ++cy)
    for (int cx = 0; cx < cells_x_; ++cx) {
      const float* row = nearest_.data() + std::size_t(cy) * cells_x_;
      float low = row[cx];
      if (cx > 0) low = low_of(low, row[cx - 1]);
      if (cx + 1 < cells_x_) low = low_of(low, row[cx + 1]);
      row_minimum_[std::size_t(cy) * cells_x_ + cx] = low;
    }
  const auto sigma_scale = static_cast<float>(f.sigma_disparity_px / (f.f_px * f.baseline_m));
  for (int cy = 0; cy < cells_y_; ++cy)
    for (int cx = 0; cx < cells_x_; ++cx) {
      const std::size_t i = std::size_t(cy) * cells_x_ + cx;
      float low = row_minimum_[i];
      if (cy > 0) low = low_of(low, row_minimum_[i - cells_x_]);
      if (cy + 1 < cells_y_) low = low_of(low, row_minimum_[i + cells_x_]);
      free_depth_[i] = nearest_[i] > 0 ? low - 2 * sigma_scale * low * low : 0;
    }
}

void ProjectiveIntegrator::carve_free(const DepthFrame& f, OccupancyMap& map,
                                      IntegrationReport& report) {
  if (!(farthest_m_ > 0)) return;
  // Map rectangle under the frustum: its four corners at the farthest depth and the camera.
  Eigen::AlignedBox3d box;
  box.extend(f.T_map_rectified.translation());
  for (int corner = 0; corner < 4; ++corner) {
    const double u = (corner & 1) != 0 ? f.width : 0;
    const double v = (corner & 2) != 0 ? f.height : 0;
    box.extend(f.T_map_rectified * Eigen::Vector3d((u - f.cx_px) / f.f_px * farthest_m_,
                                                   (v - f.cy_px) / f.f_px * farthest_m_,
                                                   double(farthest_m_)));
  }
  const double z_low = std::max(box.min().z(), settings_.z_min_m);
  const double z_high = std::min(box.max().z(), settings_.z_max_m);
  if (!(z_low < z_high)) return;
  const int tx0 = tile_of(map.index(box.min().x()));
  const int tx1 = tile_of(map.index(box.max().x()));
  const int ty0 = tile_of(map.index(box.min().y()));
  const int ty1 = tile_of(map.index(box.max().y()));
  const int bz0 = tile_of(map.index(z_low));
  const int bz1 = tile_of(map.index(z_high));
  for (int ty = ty0; ty <= ty1; ++ty)
    for (int tx = tx0; tx <= tx1; ++tx) {
      Tile& tile = map.tile({tx, ty});
      for (int bz = bz0; bz <= bz1; ++bz) carve_block(f, tile, bz, map, report);
    }
}

void ProjectiveIntegrator::carve_block(const DepthFrame& f, Tile& tile, int block_z,
                                       OccupancyMap& map, IntegrationReport& report) {
  const Eigen::Isometry3d T_rectified_map = f.T_map_rectified.inverse();
  const double voxel = map.voxel_m();
  const auto corner_of = [&](int x, int y, int z) {
    return Eigen::Vector3d((tile.key.x * kTileEdge + x) * voxel,
                           (tile.key.y * kTileEdge + y) * voxel, (block_z * kTileEdge + z) * voxel);
  };
  // Outside the view or behind all that is seen: nothing to do. Corners in front of the camera
  // bound the block's image.
  double z_near = std::numeric_limits<double>::max();
  double u_low = z_near, u_high = -z_near, v_low = z_near, v_high = -z_near;
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3d p =
        T_rectified_map *
        corner_of((c & 1) * kTileEdge, (c >> 1 & 1) * kTileEdge, (c >> 2) * kTileEdge);
    z_near = std::min(z_near, p.z());
    const double z = std::max(p.z(), 0.05);
    u_low = std::min(u_low, p.x() / z), u_high = std::max(u_high, p.x() / z);
    v_low = std::min(v_low, p.y() / z), v_high = std::max(v_high, p.y() / z);
  }
  if (z_near > farthest_m_) return;
  if (z_near > 0.05 && (u_high * f.f_px + f.cx_px < 0 || u_low * f.f_px + f.cx_px > f.width ||
                        v_high * f.f_px + f.cy_px < 0 || v_low * f.f_px + f.cy_px > f.height))
    return;

  const auto found = tile.blocks.find(block_z);
  Block* block = found == tile.blocks.end() ? nullptr : found->second.get();
  const Eigen::Matrix3f R = T_rectified_map.linear().cast<float>();
  const auto step = static_cast<float>(voxel);
  const Eigen::Vector3f along_x = step * R.col(0);
  const bool level = std::abs(along_x.z()) < 1e-6F * step;  // no tilt: one depth a row
  // From the centre to the farthest point of the voxel along the view.
  const float reach = 0.5F * step * (std::abs(R(2, 0)) + std::abs(R(2, 1)) + std::abs(R(2, 2)));
  const auto focal = static_cast<float>(f.f_px / cell_px_);
  const auto cu = static_cast<float>((f.cx_px + 0.5) / cell_px_);
  const auto cv = static_cast<float>((f.cy_px + 0.5) / cell_px_);
  const int z_first = std::max(0, map.index(settings_.z_min_m) - block_z * kTileEdge);
  const int z_last = std::min(kTileEdge - 1, map.index(settings_.z_max_m) - block_z * kTileEdge);
  const auto columns = static_cast<float>(cells_x_);
  const auto rows = static_cast<float>(cells_y_);
  std::uint64_t freed = 0;
  for (int z = z_first; z <= z_last; ++z)
    for (int y = 0; y < kTileEdge; ++y) {
      const Eigen::Vector3d centre = corner_of(0, y, z) + Eigen::Vector3d::Constant(0.5 * voxel);
      const Eigen::Vector3f p0 = (T_rectified_map * centre).cast<float>();
      if (level && (p0.z() < step || p0.z() + reach >= farthest_m_)) continue;
      float inverse_z = focal / p0.z();
      for (int x = 0; x < kTileEdge; ++x) {
        const float depth = p0.z() + float(x) * along_x.z();
        if (!level) {
          if (depth < step) continue;
          inverse_z = focal / depth;
        }
        const float a = (p0.x() + float(x) * along_x.x()) * inverse_z + cu;
        const float b = (p0.y() + float(x) * along_x.y()) * inverse_z + cv;
        if (!(a >= 0 && b >= 0 && a < columns && b < rows)) continue;
        const float limit = free_depth_[std::size_t(int(b)) * cells_x_ + std::size_t(int(a))];
        if (depth + reach >= limit) continue;
        if (block == nullptr && (block = map.block(tile, block_z)) == nullptr) return;
        std::int8_t& log_odds =
            block->log_odds[static_cast<std::size_t>((z * kTileEdge + y) * kTileEdge + x)];
        ++freed;
        if (log_odds == kLogOddsMin) continue;
        // A voxel with points of this very frame is not free, whatever passes beside them.
        if (log_odds > kMiss && hits_.count(tile.key.x * kTileEdge + x, tile.key.y * kTileEdge + y,
                                            block_z * kTileEdge + z) > 0)
          continue;
        OccupancyMap::update(log_odds, kMiss);
        tile.changed = true;
      }
    }
  report.freed += freed;
}

void ProjectiveIntegrator::apply_hits(TimeNs time, OccupancyMap& map, IntegrationReport& report) {
  hits_.for_each([&](const HitTable::Hit& hit) {
    // A voxel with few points right beside one with many, above or below, holds the noise of the
    // surface in the other one. A surface on the border of two has about half of them in each, a
    // wall the same number in all.
    const std::uint32_t beside =
        std::max(hits_.count(hit.x, hit.y, hit.z - 1), hits_.count(hit.x, hit.y, hit.z + 1));
    if (hit.count < min_points_ || kNoiseRatio * hit.count < beside) {
      ++report.weak;
      return;
    }
    Tile& tile = map.tile({tile_of(hit.x), tile_of(hit.y)});
    Block* block = map.block(tile, tile_of(hit.z));
    if (block == nullptr) return;
    const int column = in_tile(hit.y) * kTileEdge + in_tile(hit.x);
    const int index = in_tile(hit.z) * kTileColumns + column;
    OccupancyMap::update(block->log_odds[static_cast<std::size_t>(index)], kHit);
    const auto mean = [&hit](std::uint32_t sum) {
      return static_cast<std::uint8_t>(sum / hit.count);
    };
    map.observe_surface(*block, index, hit.z, double(hit.height_sum_m) / hit.count, mean(hit.r_sum),
                        mean(hit.g_sum), mean(hit.b_sum));
    tile.last_observed[static_cast<std::size_t>(column)] = time;
    tile.changed = true;
    ++report.occupied;
  });
}

}  // namespace crane
