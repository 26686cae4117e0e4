#include "sim/meshes.hpp"

#include <cmath>
#include <numbers>

namespace crane {
namespace {

void add_box(Mesh& mesh, const Eigen::Isometry3d& T_map_box, const Eigen::Vector3d& low,
             const Eigen::Vector3d& high) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d p = T_map_box * Eigen::Vector3d((i & 1) != 0 ? high.x() : low.x(),
                                                          (i & 2) != 0 ? high.y() : low.y(),
                                                          (i & 4) != 0 ? high.z() : low.z());
    mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
  }
  constexpr std::uint32_t kFaces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 7, 5}, {4, 6, 7},
                                           {0, 5, 1}, {0, 4, 5}, {2, 3, 7}, {2, 7, 6},
                                           {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  for (const auto& f : kFaces) mesh.triangles.push_back({first + f[0], first + f[1], first + f[2]});
}

/// Closed cylinder along local z.
void add_cylinder(Mesh& mesh, const Eigen::Isometry3d& T_map_cylinder, double radius, double z0,
                  double z1) {
  constexpr std::uint32_t kSides = 96;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto add = [&](double x, double y, double z) {
    const Eigen::Vector3d p = T_map_cylinder * Eigen::Vector3d(x, y, z);
    mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
  };
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double a = 2 * std::numbers::pi * i / kSides;
    add(radius * std::cos(a), radius * std::sin(a), z0);
    add(radius * std::cos(a), radius * std::sin(a), z1);
  }
  add(0, 0, z0);
  add(0, 0, z1);
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

}  // namespace

Mesh mesh_of(const SceneObstacle& o) {
  const TrueObstacle& s = o.shape;
  Mesh mesh;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(s.x_m, s.y_m, 0);
  T.linear() = Eigen::AngleAxisd(s.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const double x = s.size_x_m / 2;
  const double y = s.size_y_m / 2;
  if (s.kind == "box") {
    add_box(mesh, T, {-x, -y, o.base_m}, {x, y, s.height_m});
  } else if (s.kind == "cylinder") {
    add_cylinder(mesh, T, s.radius_m, o.base_m, s.height_m);
  } else if (s.kind == "pipe") {  // lying along local x, its top at height_m
    T.translation().z() = s.height_m - s.radius_m;
    T.linear() = T.linear() * Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY());
    add_cylinder(mesh, T, s.radius_m, -s.length_m / 2, s.length_m / 2);
  } else {  // chair: seat, four legs, back
    constexpr double kSeat = 0.04;
    constexpr double kLeg = 0.03;
    add_box(mesh, T, {-x, -y, s.seat_height_m - kSeat}, {x, y, s.seat_height_m});
    for (double side_x : {-x, x - kLeg})
      for (double side_y : {-y, y - kLeg})
        add_box(mesh, T, {side_x, side_y, 0},
                {side_x + kLeg, side_y + kLeg, s.seat_height_m - kSeat});
    add_box(mesh, T, {-x, y - kLeg, s.seat_height_m}, {x, y, s.height_m});
  }
  return mesh;
}

Mesh floor_mesh(double half) {
  Mesh mesh;
  const auto h = static_cast<float>(half);
  mesh.vertices = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace crane
