#include "sim/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crane {
namespace {

/// A box or a cylinder along z, in a frame of its own.
struct Solid {
  Eigen::Isometry3d T_map_solid = Eigen::Isometry3d::Identity();
  Eigen::Vector3d low, high;
  bool round = false;
};

/// What an obstacle is made of; no two solids overlap.
std::vector<Solid> solids_of(const SceneObstacle& o) {
  const TrueObstacle& s = o.shape;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(s.x_m, s.y_m, 0);
  T.linear() = Eigen::AngleAxisd(s.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const double x = s.size_x_m / 2;
  const double y = s.size_y_m / 2;
  const double r = s.radius_m;
  if (s.kind == "box") return {{T, {-x, -y, o.base_m}, {x, y, s.height_m}}};
  if (s.kind == "cylinder") return {{T, {-r, -r, o.base_m}, {r, r, s.height_m}, true}};
  if (s.kind == "pipe") {  // lying along local x, its top at height_m
    T.translation().z() = s.height_m - r;
    T.linear() = T.linear() * Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY());
    return {{T, {-r, -r, -s.length_m / 2}, {r, r, s.length_m / 2}, true}};
  }
  // chair: seat, back, four legs
  constexpr double kSeat = 0.04;
  constexpr double kLeg = 0.03;
  const double seat = s.seat_height_m;
  std::vector<Solid> parts = {{T, {-x, -y, seat - kSeat}, {x, y, seat}},
                              {T, {-x, y - kLeg, seat}, {x, y, s.height_m}}};
  for (double side_x : {-x, x - kLeg})
    for (double side_y : {-y, y - kLeg})
      parts.push_back({T, {side_x, side_y, 0}, {side_x + kLeg, side_y + kLeg, seat - kSeat}});
  return parts;
}

void add_box(Mesh& mesh, const Solid& s) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d p =
        s.T_map_solid * Eigen::Vector3d((i & 1) != 0 ? s.high.x() : s.low.x(),
                                        (i & 2) != 0 ? s.high.y() : s.low.y(),
                                        (i & 4) != 0 ? s.high.z() : s.low.z());
    mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
  }
  constexpr std::uint32_t kFaces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 7, 5}, {4, 6, 7},
                                           {0, 5, 1}, {0, 4, 5}, {2, 3, 7}, {2, 7, 6},
                                           {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  for (const auto& f : kFaces) mesh.triangles.push_back({first + f[0], first + f[1], first + f[2]});
}

void add_cylinder(Mesh& mesh, const Solid& s) {
  constexpr std::uint32_t kSides = 96;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto add = [&](double x, double y, double z) {
    const Eigen::Vector3d p = s.T_map_solid * Eigen::Vector3d(x, y, z);
    mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
  };
  const double radius = s.high.x();
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double a = 2 * std::numbers::pi * i / kSides;
    add(radius * std::cos(a), radius * std::sin(a), s.low.z());
    add(radius * std::cos(a), radius * std::sin(a), s.high.z());
  }
  add(0, 0, s.low.z());
  add(0, 0, s.high.z());
  const std::uint32_t low = first + 2 * kSides;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t a = first + 2 * i;
    const std::uint32_t b = first + 2 * ((i + 1) % kSides);
    mesh.triangles.push_back({a, b, a + 1});
    mesh.triangles.push_back({b, b + 1, a + 1});
    mesh.triangles.push_back({low, b, a});
    mesh.triangles.push_back({low + 1, a + 1, b + 1});
  }
}

bool inside(const Solid& s, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = s.T_map_solid.inverse() * p_map;
  return (p.array() > s.low.array()).all() && (p.array() < s.high.array()).all() &&
         (!s.round || p.head<2>().norm() < s.high.x());
}

}  // namespace

Mesh mesh_of(const SceneObstacle& obstacle) {
  Mesh mesh;
  for (const Solid& solid : solids_of(obstacle))
    solid.round ? add_cylinder(mesh, solid) : add_box(mesh, solid);
  return mesh;
}

bool inside(const SceneObstacle& obstacle, const Eigen::Vector3d& p_map) {
  if (p_map.z() >= obstacle.shape.height_m) return false;  // most of a map is above
  const std::vector<Solid> solids = solids_of(obstacle);
  return std::any_of(solids.begin(), solids.end(),
                     [&](const Solid& s) { return inside(s, p_map); });
}

Mesh floor_mesh(double half) {
  Mesh mesh;
  const auto h = static_cast<float>(half);
  mesh.vertices = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace crane
