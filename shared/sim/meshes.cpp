// SPDX-License-Identifier: Apache-2.0
#include "sim/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crane {
namespace {

constexpr int kManySides = 96, kFewSides = 24;
constexpr int kCableParts = 24;

/// A box or a cylinder along z, in a frame of its own.
struct Solid {
  Eigen::Isometry3d T_map_solid = Eigen::Isometry3d::Identity();
  Eigen::Vector3d low, high;
  bool round = false;
  int sides = kManySides;  ///< of a round one
  double low_end = -1;     ///< of a box: its upper side falls to here at low x; < 0: it is level
};

Solid rod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius) {
  const Eigen::Vector3d along = to - from;
  Solid s;
  s.T_map_solid.translation() = (from + to) / 2;
  s.T_map_solid.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), along).toRotationMatrix();
  s.low = {-radius, -radius, -along.norm() / 2};
  s.high = {radius, radius, along.norm() / 2};
  s.round = true;
  s.sides = kFewSides;
  return s;
}

/// A point of what hangs between both ends: a parabola is near enough to a catenary.
Eigen::Vector3d hanging_point(const TrueObstacle& s, double share) {
  const Eigen::Vector3d from(s.from_m.data()), to(s.to_m.data());
  Eigen::Vector3d p = from + share * (to - from);
  p.z() -= 4 * s.sag_m * share * (1 - share);
  return p;
}

/// Links of four rods each, by turns flat and on edge, that reach into each other.
void add_links(const TrueObstacle& s, std::vector<Solid>& out) {
  const double r = s.radius_m;
  const Eigen::Vector3d from(s.from_m.data()), to(s.to_m.data());
  const double pitch = 7 * r;
  const int count = std::max(1, int(std::lround((to - from).norm() / pitch)));
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d a = hanging_point(s, double(i) / count);
    const Eigen::Vector3d b = hanging_point(s, double(i + 1) / count);
    const Eigen::Vector3d along = (b - a).normalized();
    Eigen::Vector3d flat = along.cross(Eigen::Vector3d::UnitZ());
    if (flat.norm() < 1e-6) flat = Eigen::Vector3d::UnitX();  // it hangs straight down
    flat.normalize();
    const Eigen::Vector3d side = 2 * r * (i % 2 == 0 ? flat : along.cross(flat));
    const Eigen::Vector3d reach = 1.5 * r * along;
    out.push_back(rod(a - reach + side, b + reach + side, r));
    out.push_back(rod(a - reach - side, b + reach - side, r));
    out.push_back(rod(a - reach - side, a - reach + side, r));
    out.push_back(rod(b + reach - side, b + reach + side, r));
  }
}

/// Rods, cables, chains.
std::vector<Solid> line_solids(const TrueObstacle& s) {
  std::vector<Solid> out;
  if (s.kind == "chain") {
    add_links(s, out);
    return out;
  }
  const int parts = s.sag_m > 0 ? kCableParts : 1;
  for (int i = 0; i < parts; ++i)
    out.push_back(rod(hanging_point(s, double(i) / parts), hanging_point(s, double(i + 1) / parts),
                      s.radius_m));
  return out;
}

/// What an obstacle is made of.
std::vector<Solid> solids_of(const SceneObstacle& o) {
  const TrueObstacle& s = o.shape;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(s.x_m, s.y_m, 0);
  T.linear() = Eigen::AngleAxisd(s.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const double x = s.size_x_m / 2;
  const double y = s.size_y_m / 2;
  const double r = s.radius_m;
  if (s.is_line()) return line_solids(s);
  if (s.kind == "wedge")
    return {{T, {-x, -y, o.base_m}, {x, y, s.height_m}, false, kManySides, s.low_m}};
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

/// Whether a corner of a box is at the lower end of a wedge.
bool slopes(const Solid& s, int corner) {
  return s.low_end >= 0 && (corner & 1) == 0;
}

void add_box(Mesh& mesh, const Solid& s) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d p = s.T_map_solid * Eigen::Vector3d((i & 1) != 0 ? s.high.x() : s.low.x(),
                                                              (i & 2) != 0 ? s.high.y() : s.low.y(),
                                                              (i & 4) == 0   ? s.low.z()
                                                              : slopes(s, i) ? s.low_end
                                                                             : s.high.z());
    mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
  }
  constexpr std::uint32_t kFaces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 7, 5}, {4, 6, 7},
                                           {0, 5, 1}, {0, 4, 5}, {2, 3, 7}, {2, 7, 6},
                                           {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  for (const auto& f : kFaces) mesh.triangles.push_back({first + f[0], first + f[1], first + f[2]});
}

void add_cylinder(Mesh& mesh, const Solid& s) {
  const auto sides = static_cast<std::uint32_t>(s.sides);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto add = [&](double x, double y, double z) {
    const Eigen::Vector3d p = s.T_map_solid * Eigen::Vector3d(x, y, z);
    mesh.vertices.push_back({float(p.x()), float(p.y()), float(p.z())});
  };
  const double radius = s.high.x();
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double a = 2 * std::numbers::pi * i / sides;
    add(radius * std::cos(a), radius * std::sin(a), s.low.z());
    add(radius * std::cos(a), radius * std::sin(a), s.high.z());
  }
  add(0, 0, s.low.z());
  add(0, 0, s.high.z());
  const std::uint32_t low = first + 2 * sides;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t a = first + 2 * i;
    const std::uint32_t b = first + 2 * ((i + 1) % sides);
    mesh.triangles.push_back({a, b, a + 1});
    mesh.triangles.push_back({b, b + 1, a + 1});
    mesh.triangles.push_back({low, b, a});
    mesh.triangles.push_back({low + 1, a + 1, b + 1});
  }
}

bool inside(const Solid& s, const Eigen::Vector3d& p_map) {
  const Eigen::Vector3d p = s.T_map_solid.inverse() * p_map;
  return (p.array() > s.low.array()).all() && (p.array() < s.high.array()).all() &&
         (!s.round || p.head<2>().norm() < s.high.x()) &&
         (s.low_end < 0 || p.z() < s.low_end + (s.high.z() - s.low_end) * (p.x() - s.low.x()) /
                                                   (s.high.x() - s.low.x()));
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

namespace {

/// Where the floor is cut: both ends, and the sides of pits.
std::vector<double> cuts(double half, const std::vector<ScenePit>& pits, bool along_x) {
  std::vector<double> out = {-half, half};
  for (const ScenePit& p : pits)
    for (const double at : {along_x ? p.x0_m : p.y0_m, along_x ? p.x1_m : p.y1_m})
      out.push_back(at);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

void add_quad(Mesh& mesh, const std::array<Eigen::Vector3d, 4>& corners) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const Eigen::Vector3d& c : corners)
    mesh.vertices.push_back({float(c.x()), float(c.y()), float(c.z())});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

void add_pit(Mesh& mesh, const ScenePit& p) {
  const double x0 = p.x0_m, x1 = p.x1_m, y0 = p.y0_m, y1 = p.y1_m, d = -p.depth_m;
  add_quad(mesh, {{{x0, y0, d}, {x1, y0, d}, {x1, y1, d}, {x0, y1, d}}});
  add_quad(mesh, {{{x0, y0, d}, {x1, y0, d}, {x1, y0, 0}, {x0, y0, 0}}});
  add_quad(mesh, {{{x0, y1, d}, {x1, y1, d}, {x1, y1, 0}, {x0, y1, 0}}});
  add_quad(mesh, {{{x0, y0, d}, {x0, y1, d}, {x0, y1, 0}, {x0, y0, 0}}});
  add_quad(mesh, {{{x1, y0, d}, {x1, y1, d}, {x1, y1, 0}, {x1, y0, 0}}});
}

}  // namespace

Mesh floor_mesh(double half, const std::vector<ScenePit>& pits) {
  Mesh mesh;
  if (pits.empty()) {
    const auto h = static_cast<float>(half);
    mesh.vertices = {{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
  }
  const std::vector<double> xs = cuts(half, pits, true), ys = cuts(half, pits, false);
  for (std::size_t i = 0; i + 1 < xs.size(); ++i)
    for (std::size_t j = 0; j + 1 < ys.size(); ++j) {
      const double x = (xs[i] + xs[i + 1]) / 2, y = (ys[j] + ys[j + 1]) / 2;
      const bool open = std::any_of(pits.begin(), pits.end(), [&](const ScenePit& p) {
        return x > p.x0_m && x < p.x1_m && y > p.y0_m && y < p.y1_m;
      });
      if (!open)
        add_quad(mesh, {{{xs[i], ys[j], 0},
                         {xs[i + 1], ys[j], 0},
                         {xs[i + 1], ys[j + 1], 0},
                         {xs[i], ys[j + 1], 0}}});
    }
  for (const ScenePit& p : pits) add_pit(mesh, p);
  return mesh;
}

}  // namespace crane
