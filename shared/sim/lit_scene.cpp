// SPDX-License-Identifier: Apache-2.0
#include "sim/lit_scene.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/expects.hpp"
#include "sim/noise.hpp"
#include "sim/surface.hpp"

namespace crane {
namespace {

using Eigen::Vector3f;
constexpr double kFloorHalf = 2000;

}  // namespace

LitScene::LitScene(const Scene& scene) : scene_(scene), device_(rtcNewDevice("threads=1")) {
  expects(device_ != nullptr, "Embree starts");
  for (const auto& [name, material] : scene_.materials) any_glass_ |= material.glass > 0;
  show(obstacles_at(scene_, 0));
}

LitScene::~LitScene() {
  if (geometry_ != nullptr) rtcReleaseScene(geometry_);
  if (device_ != nullptr) rtcReleaseDevice(device_);
}

void LitScene::show(const std::vector<std::optional<SceneObstacle>>& obstacles) {
  if (geometry_ != nullptr) rtcReleaseScene(geometry_);
  geometry_ = rtcNewScene(device_);
  rtcSetSceneFlags(geometry_, RTC_SCENE_FLAG_ROBUST);
  materials_.clear();
  origins_.clear();
  add(floor_mesh(kFloorHalf, scene_.pits), scene_.materials.at(scene_.floor_material), 0);
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    if (!obstacles[i]) continue;
    const auto id = static_cast<unsigned>(i + 1);
    add(mesh_of(*obstacles[i]), scene_.materials.at(obstacles[i]->material), id);
    if (!obstacles[i]->texture_origin.isZero()) origins_[id] = obstacles[i]->texture_origin;
  }
  rtcCommitScene(geometry_);
}

void LitScene::add(const Mesh& mesh, const Material& material, unsigned id) {
  RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  for (const auto& v : mesh.vertices) vertices = std::copy(v.begin(), v.end(), vertices);
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  for (const auto& t : mesh.triangles) indices = std::copy(t.begin(), t.end(), indices);
  rtcCommitGeometry(g);
  rtcAttachGeometryByID(geometry_, g, id);
  rtcReleaseGeometry(g);
  materials_[id] = &material;
}

LitScene::Hit LitScene::trace(const Vector3f& origin, const Vector3f& direction) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  RTCRayHit r{};
  r.ray.org_x = origin.x(), r.ray.org_y = origin.y(), r.ray.org_z = origin.z();
  r.ray.dir_x = direction.x(), r.ray.dir_y = direction.y(), r.ray.dir_z = direction.z();
  r.ray.tnear = 1e-4F;
  r.ray.tfar = kFar;
  r.ray.mask = ~0U;
  r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(geometry_, &context, &r);
  Hit hit;
  if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  hit.distance = r.ray.tfar;
  hit.id = r.hit.geomID;
  hit.normal = Vector3f(r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z).normalized();
  if (hit.normal.dot(direction) > 0) hit.normal = -hit.normal;
  return hit;
}

bool LitScene::blocked(const Vector3f& from, const Vector3f& to) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay r{};
  const Vector3f d = to - from;
  r.org_x = from.x(), r.org_y = from.y(), r.org_z = from.z();
  r.dir_x = d.x(), r.dir_y = d.y(), r.dir_z = d.z();
  r.tnear = 1e-3F;
  r.tfar = 0.999F;
  r.mask = ~0U;
  if (any_glass_) return blocked_by_opaque(from, d);
  rtcOccluded1(geometry_, &context, &r);
  return r.tfar < 0;
}

/// The same where light passes through glass.
bool LitScene::blocked_by_opaque(Vector3f from, const Vector3f& way) const {
  constexpr int kMostPanes = 16;
  constexpr float kStep = 1e-3F, kLetsThrough = 0.3F;
  float left_m = way.norm();
  const Vector3f direction = way / left_m;
  for (int pane = 0; pane < kMostPanes; ++pane) {
    from += kStep * direction;
    left_m -= kStep;
    const Hit hit = trace(from, direction);
    if (hit.distance >= 0.999F * left_m) return false;
    if (materials_.at(hit.id)->glass < kLetsThrough) return true;
    from += hit.distance * direction;
    left_m -= hit.distance;
  }
  return true;
}

/// What a mirror shows where the scene ends: the ceiling with its lamps.
Vector3f LitScene::ceiling(const Vector3f& eye, const Vector3f& direction, double seconds) const {
  constexpr float kShining = 10;
  Vector3f out = Vector3f::Ones() * float(ambient(seconds));
  if (direction.z() <= 0.01F) return out;
  for (const Lamp& lamp : scene_.lamps) {
    const Vector3f centre = lamp.centre.cast<float>();
    const Vector3f at = eye + direction * ((centre.z() - eye.z()) / direction.z());
    if (is_on(lamp, seconds) && std::abs(at.x() - centre.x()) < lamp.size_x_m / 2 &&
        std::abs(at.y() - centre.y()) < lamp.size_y_m / 2)
      out += Vector3f::Ones() * (kShining * float(lamp.power));
  }
  return out;
}

/// Light that comes to the eye from a direction, by way of mirrors and through glass.
Vector3f LitScene::look(const Vector3f& eye, const Vector3f& direction, double seconds,
                        int depth) const {
  constexpr int kDeepest = 4;
  constexpr float kOff = 1e-3F;
  const Hit hit = trace(eye, direction);
  if (hit.distance == kFar)
    return depth == 0 ? Vector3f(Vector3f::Zero()) : ceiling(eye, direction, seconds);
  const Vector3f p = eye + direction * hit.distance;
  const Material& m = *materials_.at(hit.id);
  if (m.mirror <= 0 && m.glass <= 0) return shade(p, -direction, hit, seconds);
  Vector3f out = float(1 - m.mirror - m.glass) * shade(p, -direction, hit, seconds);
  if (depth == kDeepest) return out;
  if (m.mirror > 0)
    out += float(m.mirror) * look(p + hit.normal * kOff,
                                  direction - 2 * direction.dot(hit.normal) * hit.normal, seconds,
                                  depth + 1);
  if (m.glass > 0)
    out += float(m.glass) * look(p + direction * kOff, direction, seconds, depth + 1);
  return out;
}

bool LitScene::is_on(const Lamp& lamp, double seconds) {
  return seconds >= lamp.from_s && seconds < lamp.until_s;
}
double LitScene::ambient(double seconds) const {
  const Daylight& d = scene_.daylight;
  if (d.swing <= 0) return scene_.ambient;
  return scene_.ambient * (1 + d.swing * std::sin(2 * std::numbers::pi * seconds / d.period_s));
}

/// Linear light from a surface point towards the eye.
Vector3f LitScene::shade(const Vector3f& p, const Vector3f& to_eye, const Hit& hit,
                         double seconds) const {
  const Material& m = *materials_.at(hit.id);
  const auto moved = origins_.find(hit.id);
  const Vector3f albedo = albedo_at(m, moved == origins_.end() ? p : Vector3f(p - moved->second),
                                    hit.normal, scene_.seed * 1000 + hit.id);
  Vector3f light = albedo * float(ambient(seconds));
  const Vector3f from = p + hit.normal * 1e-3F;
  // Which point of a lamp lights a point depends on the point alone: the grain of a penumbra then
  // lies on the surface, and both cameras see the same.
  constexpr float kGrain = 400;  // a 2.5 mm
  const std::uint64_t random =
      mix((std::uint64_t(std::uint32_t(int(std::floor(p.x() * kGrain)))) << 32U) ^
          (std::uint64_t(std::uint32_t(int(std::floor(p.y() * kGrain)))) << 13U) ^
          std::uint32_t(int(std::floor(p.z() * kGrain)))) +
      scene_.seed;
  for (std::size_t i = 0; i < scene_.lamps.size(); ++i) {
    const Lamp& lamp = scene_.lamps[i];
    if (!is_on(lamp, seconds)) continue;
    const Vector3f centre = lamp.centre.cast<float>();
    const float half_x = 0.5F * float(lamp.size_x_m);
    const float half_y = 0.5F * float(lamp.size_y_m);
    const Vector3f sample = centre + Vector3f((2 * uniform(random + 2 * i) - 1) * half_x,
                                              (2 * uniform(random + 2 * i + 1) - 1) * half_y, 0);
    const Vector3f towards = sample - from;
    const float distance2 = towards.squaredNorm();
    const Vector3f l = towards / std::sqrt(distance2);
    const float cosine = hit.normal.dot(l);
    if (cosine <= 0 || l.z() <= 0 || blocked(from, sample)) continue;
    const float arriving = float(lamp.power) * l.z() / distance2;
    light += albedo * (arriving * cosine);
    if (m.gloss <= 0) continue;
    // Highlight of an area lamp: the point of the lamp nearest to the mirrored eye ray.
    const Vector3f mirrored = 2 * hit.normal.dot(to_eye) * hit.normal - to_eye;
    if (mirrored.z() <= 0.05F) continue;
    Vector3f nearest = from + mirrored * ((centre.z() - from.z()) / mirrored.z());
    nearest.x() = std::clamp(nearest.x(), centre.x() - half_x, centre.x() + half_x);
    nearest.y() = std::clamp(nearest.y(), centre.y() - half_y, centre.y() + half_y);
    const float align = std::max(0.0F, mirrored.dot((nearest - from).normalized()));
    light +=
        Vector3f::Ones() * (float(m.gloss) * arriving * 4 * std::pow(align, float(m.shininess)));
  }
  return light;
}

}  // namespace crane
