// SPDX-License-Identifier: Apache-2.0
#include "motion/align.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>

namespace crane {
namespace {

constexpr int kColumns = 16, kRows = 10;  ///< at most one patch in each part of the image
constexpr int kEdge = 8;                  ///< of a patch [px of the level]
constexpr std::size_t kPixels = std::size_t(kEdge) * kEdge;
constexpr int kFewest = 12;
/// Sum of squared brightness steps that a patch needs.
constexpr float kTexture = 40 * float(kPixels) / 4;
constexpr double kNoise = 2;  ///< standard deviation of a difference of two pixels, at least
constexpr double kDisparityBias = 0.1;  ///< [px]
constexpr double kLeastSupport = 0.4;
/// A second place that is so much of the way from a typical one to the best is as likely.
constexpr double kNearlyAsWell = 0.6;
/// A patch is explained if no more than this share of its own variance, or noise, is left.
constexpr double kLeft = 0.2, kLeftNoise = 3;

struct Patch {
  double x = 0, y = 0;  ///< ray of its middle
  double inverse_m = 0;
  int u = 0, v = 0;  ///< its first pixel, of the level
  std::array<float, kPixels> grey{}, gx{}, gy{};
  double variance = 0;  ///< of its brightness
  bool used = false;
};

/// One resolution of both images.
struct Level {
  const Grey& here;
  const Grey& there;
  int scale;  ///< pixels of the full image
};

float texture_at(const Grey& image, int u, int v) {
  float sum = 0;
  for (int y = v; y < v + kEdge; y += 2)
    for (int x = u; x < u + kEdge; x += 2) {
      const std::uint8_t* p = image.row(y) + x;
      const int gx = p[1] - p[-1];
      const int gy = p[image.width] - p[-image.width];
      sum += float(gx * gx + gy * gy);
    }
  return sum;
}

double variance_of(const std::array<float, kPixels>& grey) {
  double sum = 0;
  double squares = 0;
  for (const float g : grey) sum += g, squares += double(g) * g;
  return (squares - sum * sum / double(kPixels)) / double(kPixels - 1);
}

/// One patch a part of the image: the one with most texture of a few.
std::vector<Patch> choose(const DepthFrame& f, const PlacedImage& image, const Level& level) {
  std::vector<Patch> out;
  const Grey& grey = level.here;
  constexpr int kTries = 3;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column) {
      Patch best;
      float most = kTexture;
      for (int t = 0; t < kTries * kTries; ++t) {
        const int u =
            (column * kTries + t % kTries) * (grey.width - kEdge - 4) / (kColumns * kTries) + 2;
        const int v =
            (row * kTries + t / kTries) * (grey.height - kEdge - 4) / (kRows * kTries) + 2;
        const int full_u = (u + kEdge / 2) * level.scale;
        const int full_v = (v + kEdge / 2) * level.scale;
        const float depth =
            std::abs(f.depth_m[std::size_t(full_v) * f.width + std::size_t(full_u)]);
        if (!(depth > 0)) continue;
        const float texture = texture_at(grey, u, v);
        if (texture <= most) continue;
        most = texture;
        best.u = u, best.v = v;
        best.inverse_m = 1 / double(depth);
        best.used = true;
      }
      if (!best.used) continue;
      const double middle = (kEdge - 1) / 2.0;
      const double offset = (level.scale - 1) / 2.0;
      best.x = ((best.u + middle) * level.scale + offset - image.cx_px) / image.f_px;
      best.y = ((best.v + middle) * level.scale + offset - image.cy_px) / image.f_px;
      for (std::size_t i = 0; i < kPixels; ++i) {
        const std::uint8_t* p = grey.row(best.v + int(i) / kEdge) + best.u + int(i) % kEdge;
        best.grey[i] = p[0];
        best.gx[i] = float(p[1] - p[-1]) / 2;
        best.gy[i] = float(p[grey.width] - p[-grey.width]) / 2;
      }
      best.variance = variance_of(best.grey);
      out.push_back(best);
    }
  return out;
}

/// Where the patch's first pixel falls in the other image [px of the level]; nothing: outside.
std::optional<Eigen::Vector2d> move(const Patch& p, const Warp& warp, const PlacedImage& other,
                                    const Level& level) {
  const Eigen::Vector3d q = warp.R * Eigen::Vector3d(p.x, p.y, 1) + p.inverse_m * warp.t;
  if (!(q.z() > 0.1)) return std::nullopt;
  const double offset = (level.scale - 1) / 2.0;
  const double middle = (kEdge - 1) / 2.0;
  const Eigen::Vector2d at(
      (q.x() / q.z() * other.f_px + other.cx_px - offset) / level.scale - middle,
      (q.y() / q.z() * other.f_px + other.cy_px - offset) / level.scale - middle);
  if (!(at.x() >= 1 && at.y() >= 1 && at.x() < level.there.width - kEdge - 2 &&
        at.y() < level.there.height - kEdge - 2))
    return std::nullopt;
  return at;
}

/// Differences of brightness, without that of their means; returns their variance.
double differences(const Patch& p, const Eigen::Vector2d& at, const Grey& there,
                   std::array<float, kPixels>& out) {
  const int x0 = int(at.x()), y0 = int(at.y());
  const auto fx = float(at.x() - x0), fy = float(at.y() - y0);
  float mean = 0;
  for (int y = 0; y < kEdge; ++y) {
    const std::uint8_t* a = there.row(y0 + y) + x0;
    const std::uint8_t* b = a + there.width;
    for (int x = 0; x < kEdge; ++x) {
      const float top = float(a[x]) + fx * float(a[x + 1] - a[x]);
      const float low = float(b[x]) + fx * float(b[x + 1] - b[x]);
      const auto i = std::size_t(y * kEdge + x);
      out[i] = p.grey[i] - (top + fy * (low - top));
      mean += out[i];
    }
  }
  mean /= float(kPixels);
  float squares = 0;
  for (float& d : out) d -= mean, squares += d * d;
  return double(squares) / double(kPixels - 1);
}

/// Columns: how the patch's pixel moves with the frame's place in the map.
Eigen::Matrix2d motion_of(const Patch& p, const Warp& warp, const Eigen::Matrix3d& R_to_map,
                          double f_px, int scale) {
  const Eigen::Vector3d q = warp.R * Eigen::Vector3d(p.x, p.y, 1) + p.inverse_m * warp.t;
  const double k = f_px / scale / q.z() * p.inverse_m;
  Eigen::Matrix2d out;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector3d moved = R_to_map.row(axis).transpose();
    out.col(axis) = k * Eigen::Vector2d(moved.x() - q.x() / q.z() * moved.z(),
                                        moved.y() - q.y() / q.z() * moved.z());
  }
  return out;
}

struct Solved {
  Eigen::Vector2d correction = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  int patches = 0, explained = 0;
  double typical = 0;  ///< variance of a patch's differences
};

class Solver {
 public:
  Solver(const DepthFrame& frame, const PlacedImage& image, const PlacedImage& other)
      : frame_(frame), image_(image), other_(other) {}

  std::optional<Solved> solve(const Level& level, Eigen::Vector2d correction, int rounds,
                              AlignFlaw& flaw) const {
    std::vector<Patch> patches = choose(frame_, image_, level);
    Solved out;
    double typical = 1e9;
    for (int round = 0; round < rounds; ++round) {
      const Warp warp = warp_between(image_.T_map_rectified, other_.T_map_rectified, correction);
      const Eigen::Matrix3d R = other_.T_map_rectified.linear();
      Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
      Eigen::Vector2d b = Eigen::Vector2d::Zero();
      std::vector<double> residuals;
      std::array<float, kPixels> d{};
      double weights = 0;
      double squares = 0;
      out.patches = out.explained = 0;
      for (const Patch& p : patches) {
        const auto at = move(p, warp, other_, level);
        if (!at) continue;
        ++out.patches;
        const double variance = differences(p, *at, level.there, d);
        residuals.push_back(variance);
        // Tukey's weight on how badly the patch fits.
        const double limit = 9 * std::max(typical, kNoise * kNoise);
        if (variance >= limit) continue;
        const double share = 1 - variance / limit;
        const double w = share * share;
        const double left = std::max(kLeft * p.variance, kLeftNoise * kNoise * kNoise);
        out.explained += variance < std::min(left, limit / 2) ? 1 : 0;
        const Eigen::Matrix2d J = motion_of(p, warp, R, image_.f_px, level.scale);
        double xx = 0, xy = 0, yy = 0, xd = 0, yd = 0;
        for (std::size_t i = 0; i < kPixels; ++i) {
          const double gx = p.gx[i], gy = p.gy[i];
          xx += gx * gx, xy += gx * gy, yy += gy * gy, xd += gx * d[i], yd += gy * d[i];
        }
        Eigen::Matrix2d S;
        S << xx, xy, xy, yy;
        A += w * J.transpose() * S * J;
        b += w * J.transpose() * Eigen::Vector2d(xd, yd);
        weights += w;
        squares += w * variance;
      }
      flaw = out.patches < kFewest ? AlignFlaw::kTooFew : AlignFlaw::kNoFit;
      if (out.patches < kFewest || weights < kFewest * 0.3) return std::nullopt;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(A);
      if (!(eigen.eigenvalues()(0) > 1e-6 * eigen.eigenvalues()(1))) return std::nullopt;
      correction += A.ldlt().solve(b);
      // Pixels beside each other share texture and interpolation: as if a quarter were independent.
      out.covariance = 4 * squares / weights * A.inverse();
      std::nth_element(residuals.begin(), residuals.begin() + std::ptrdiff_t(residuals.size() / 2),
                       residuals.end());
      typical = residuals[residuals.size() / 2];
    }
    out.correction = correction;
    out.typical = typical;
    return out;
  }

  /// The best of all places around on a grid of the level's pixels.
  std::optional<Eigen::Vector2d> search(const Level& level, double reach_m, bool& ambiguous) const {
    const std::vector<Patch> patches = choose(frame_, image_, level);
    double inverse = 0;
    for (const Patch& p : patches) inverse = std::max(inverse, p.inverse_m);
    if (patches.size() < kFewest) return std::nullopt;
    constexpr int kMost = 40;
    const double step = std::max(level.scale / (image_.f_px * inverse), reach_m / kMost);
    const int reach = int(std::ceil(reach_m / step));
    const int edge = 2 * reach + 1;
    std::vector<double> costs(std::size_t(edge) * std::size_t(edge), 1e9);
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i)
        costs[std::size_t((j + reach) * edge + i + reach)] =
            cost(level, patches, Eigen::Vector2d(i, j) * step);
    const auto best = std::min_element(costs.begin(), costs.end());
    if (*best >= 1e9) return std::nullopt;
    const int at = int(best - costs.begin());
    const int bi = at % edge, bj = at / edge;
    std::vector<double> sorted = costs;
    std::nth_element(sorted.begin(), sorted.begin() + std::ptrdiff_t(sorted.size() / 2),
                     sorted.end());
    const double typical = std::min(sorted[sorted.size() / 2], 25.0);
    const double limit = typical - kNearlyAsWell * (typical - *best);
    constexpr int kBeside = 3;
    for (int j = 0; j < edge; ++j)
      for (int i = 0; i < edge; ++i)
        if (std::max(std::abs(i - bi), std::abs(j - bj)) > kBeside)
          ambiguous |= costs[std::size_t(j * edge + i)] < limit;
    return Eigen::Vector2d(bi - reach, bj - reach) * step;
  }

 private:
  double cost(const Level& level, const std::vector<Patch>& patches,
              const Eigen::Vector2d& correction) const {
    const Warp warp = warp_between(image_.T_map_rectified, other_.T_map_rectified, correction);
    double sum = 0;
    int count = 0;
    for (const Patch& p : patches) {
      const auto at = move(p, warp, other_, level);
      if (!at) continue;
      const int x0 = int(at->x() + 0.5), y0 = int(at->y() + 0.5);
      float there[16];
      float mean = 0;
      for (int k = 0; k < 16; ++k) {
        const int y = k / 4 * 2, x = k % 4 * 2;
        there[k] = p.grey[std::size_t(y * kEdge + x)] - float(level.there.row(y0 + y)[x0 + x]);
        mean += there[k] / 16;
      }
      float difference = 0;
      for (const float d : there) difference += std::abs(d - mean);
      // What is hidden or moved must not decide.
      sum += std::min(difference / 16, 25.0F);
      ++count;
    }
    return count >= kFewest ? sum / count : 1e9;
  }

  const DepthFrame& frame_;
  const PlacedImage& image_;
  const PlacedImage& other_;
};

}  // namespace

std::optional<Alignment> align(const DepthFrame& frame, const PlacedImage& image,
                               const PlacedImage& other, const AlignSettings& settings,
                               AlignFlaw* flaw) {
  AlignFlaw ignored = AlignFlaw::kTooFew;
  AlignFlaw& why = flaw != nullptr ? *flaw : ignored;
  why = AlignFlaw::kTooFew;
  const Level half{image.half, other.half, 2}, full{image.full, other.full, 1};
  constexpr int kSmallest = 64;
  if (image.half.width < kSmallest || image.half.height < kSmallest ||
      other.half.width < kSmallest || other.half.height < kSmallest)
    return std::nullopt;
  const Solver solver(frame, image, other);
  Alignment out;
  Eigen::Vector2d start = Eigen::Vector2d::Zero();
  if (settings.reach_m > 0) {
    const auto found = solver.search(half, settings.reach_m, out.ambiguous);
    if (!found) return std::nullopt;
    start = *found;
  }
  const auto rough = solver.solve(half, start, 4, why);
  if (!rough) return std::nullopt;
  const auto fine = solver.solve(full, rough->correction, 4, why);
  if (!fine) return std::nullopt;
  out.correction_m = fine->correction;
  const Eigen::Vector2d stated =
      (image.T_map_rectified.translation() - other.T_map_rectified.translation()).head<2>();
  out.displacement_m = stated + out.correction_m;
  out.patches = fine->patches;
  out.noise_grey = std::sqrt(fine->typical / 2);
  out.support = double(fine->explained) / fine->patches;
  if (out.support < kLeastSupport) return std::nullopt;
  // The disparity of the floor, from the typical depth.
  std::vector<float> depths;
  for (std::size_t i = 0; i < std::size_t(frame.width) * frame.height; i += 997)
    if (const float z = std::abs(frame.depth_m[i]); z > 0) depths.push_back(z);
  if (depths.empty()) return std::nullopt;
  std::nth_element(depths.begin(), depths.begin() + std::ptrdiff_t(depths.size() / 2),
                   depths.end());
  const double disparity = frame.f_px * frame.baseline_m / double(depths[depths.size() / 2]);
  const Eigen::Vector2d scaled = kDisparityBias / disparity * out.displacement_m;
  out.covariance_m2 = fine->covariance + scaled * scaled.transpose();
  out.sigma_m =
      std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(out.covariance_m2).eigenvalues()(1));
  return out;
}

}  // namespace crane
