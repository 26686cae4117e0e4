#include "sim/renderer.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <thread>

#include "sim/meshes.hpp"
#include "sim/noise.hpp"
#include "sim/sensor.hpp"
#include "sim/surface.hpp"

namespace crane {
namespace {

using Eigen::Vector3f;
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr double kFloorHalf = 2000;

/// Unit rays of all sub-pixels, in the camera frame; the lens is inverted by fixed-point steps.
std::vector<Vector3f> camera_rays(const CameraModel& c, int samples, const Sensor* dirt = nullptr) {
  std::vector<Vector3f> rays;
  rays.reserve(std::size_t(c.width) * c.height * std::size_t(samples));
  const int side = std::max(1, int(std::lround(std::sqrt(samples))));
  for (std::uint32_t v = 0; v < c.height; ++v)
    for (std::uint32_t u = 0; u < c.width; ++u)
      for (int s = 0; s < samples; ++s) {
        const double du = samples == 1   ? 0
                          : samples == 2 ? (s == 0 ? -0.25 : 0.25)
                                         : (s % side + 0.5) / side - 0.5;
        const double dv = samples == 1   ? 0
                          : samples == 2 ? (s == 0 ? -0.25 : 0.25)
                                         : (s / side % side + 0.5) / side - 0.5;
        double at_u = u + du;
        double at_v = v + dv;
        if (dirt != nullptr && dirt->bends()) {
          const Eigen::Vector2f bent = dirt->looks_at(float(at_u), float(at_v));
          at_u = bent.x(), at_v = bent.y();
        }
        const double xd = (at_u - c.cx_px) / c.fx_px;
        const double yd = (at_v - c.cy_px) / c.fy_px;
        double x = xd;
        double y = yd;
        for (int i = 0; i < 20; ++i) {
          const double r2 = x * x + y * y;
          const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2;
          x = (xd - 2 * c.p1 * x * y - c.p2 * (r2 + 2 * x * x)) / radial;
          y = (yd - c.p1 * (r2 + 2 * y * y) - 2 * c.p2 * x * y) / radial;
        }
        rays.push_back(Vector3f(float(x), float(y), 1));
      }
  return rays;
}

void parallel_rows(int rows, const std::function<void(int)>& work) {
  const int threads = std::max(1, int(std::thread::hardware_concurrency()));
  std::vector<std::jthread> pool;
  for (int t = 0; t < threads; ++t)
    pool.emplace_back([=, &work] {
      for (int row = t; row < rows; row += threads) work(row);
    });
}

float brightness(const Vector3f& light) {
  return 0.2126F * light.x() + 0.7152F * light.y() + 0.0722F * light.z();
}

}  // namespace

struct Renderer::Impl {
  Scene scene;
  RTCDevice device = nullptr;
  RTCScene geometry = nullptr;
  std::map<unsigned, const Material*> materials;  ///< by Embree geometry id
  std::map<unsigned, Vector3f> origins;           ///< of textures that moved, likewise
  bool any_glass = false;
  Sensor left_sensor, right_sensor;
  std::vector<Vector3f> left_rays, right_rays;

  explicit Impl(const Scene& of)
      : scene(of),
        left_sensor(of.camera, true, of.seed),
        right_sensor(of.camera, false, of.seed),
        left_rays(camera_rays(of.camera.rig.left, of.camera.samples, &left_sensor)),
        right_rays(camera_rays(of.camera.rig.right, of.camera.samples, &right_sensor)) {}

  /// Where cart and trolley are, and when.
  struct Moment {
    double cart_m = 0, trolley_m = 0, seconds = 0;
  };
  /// Linear light of every pixel, before the sensor.
  [[nodiscard]] std::vector<Vector3f> light(bool left, const Moment& moment) const;
  [[nodiscard]] std::uint64_t noise_seed(bool left, std::uint64_t frame) const {
    return mix(scene.seed * 31 + frame * 2 + (left ? 1 : 0)) << 24U;
  }

  void add(const Mesh& mesh, const Material& material, unsigned id) {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    for (const auto& v : mesh.vertices) vertices = std::copy(v.begin(), v.end(), vertices);
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned),
                                mesh.triangles.size()));
    for (const auto& t : mesh.triangles) indices = std::copy(t.begin(), t.end(), indices);
    rtcCommitGeometry(g);
    rtcAttachGeometryByID(geometry, g, id);
    rtcReleaseGeometry(g);
    materials[id] = &material;
  }

  struct Hit {
    float distance = kFar;
    Vector3f normal{0, 0, 1};
    unsigned id = 0;
  };

  [[nodiscard]] Hit trace(const Vector3f& origin, const Vector3f& direction) const {
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
    rtcIntersect1(geometry, &context, &r);
    Hit hit;
    if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
    hit.distance = r.ray.tfar;
    hit.id = r.hit.geomID;
    hit.normal = Vector3f(r.hit.Ng_x, r.hit.Ng_y, r.hit.Ng_z).normalized();
    if (hit.normal.dot(direction) > 0) hit.normal = -hit.normal;
    return hit;
  }

  [[nodiscard]] bool blocked(const Vector3f& from, const Vector3f& to) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay r{};
    const Vector3f d = to - from;
    r.org_x = from.x(), r.org_y = from.y(), r.org_z = from.z();
    r.dir_x = d.x(), r.dir_y = d.y(), r.dir_z = d.z();
    r.tnear = 1e-3F;
    r.tfar = 0.999F;
    r.mask = ~0U;
    if (any_glass) return blocked_by_opaque(from, d);
    rtcOccluded1(geometry, &context, &r);
    return r.tfar < 0;
  }

  /// The same where light passes through glass.
  [[nodiscard]] bool blocked_by_opaque(Vector3f from, const Vector3f& way) const {
    constexpr int kMostPanes = 16;
    constexpr float kStep = 1e-3F, kLetsThrough = 0.3F;
    float left_m = way.norm();
    const Vector3f direction = way / left_m;
    for (int pane = 0; pane < kMostPanes; ++pane) {
      from += kStep * direction;
      left_m -= kStep;
      const Hit hit = trace(from, direction);
      if (hit.distance >= 0.999F * left_m) return false;
      if (materials.at(hit.id)->glass < kLetsThrough) return true;
      from += hit.distance * direction;
      left_m -= hit.distance;
    }
    return true;
  }

  /// What a mirror shows where the scene ends: the ceiling with its lamps.
  [[nodiscard]] Vector3f ceiling(const Vector3f& eye, const Vector3f& direction,
                                 double seconds) const {
    constexpr float kShining = 10;
    Vector3f out = Vector3f::Ones() * float(ambient(seconds));
    if (direction.z() <= 0.01F) return out;
    for (const Lamp& lamp : scene.lamps) {
      const Vector3f centre = lamp.centre.cast<float>();
      const Vector3f at = eye + direction * ((centre.z() - eye.z()) / direction.z());
      if (is_on(lamp, seconds) && std::abs(at.x() - centre.x()) < lamp.size_x_m / 2 &&
          std::abs(at.y() - centre.y()) < lamp.size_y_m / 2)
        out += Vector3f::Ones() * (kShining * float(lamp.power));
    }
    return out;
  }

  /// Light that comes to the eye from a direction, by way of mirrors and through glass.
  [[nodiscard]] Vector3f look(const Vector3f& eye, const Vector3f& direction, double seconds,
                              int depth) const {
    constexpr int kDeepest = 4;
    constexpr float kOff = 1e-3F;
    const Hit hit = trace(eye, direction);
    if (hit.distance == kFar)
      return depth == 0 ? Vector3f(Vector3f::Zero()) : ceiling(eye, direction, seconds);
    const Vector3f p = eye + direction * hit.distance;
    const Material& m = *materials.at(hit.id);
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

  static bool is_on(const Lamp& lamp, double seconds) {
    return seconds >= lamp.from_s && seconds < lamp.until_s;
  }
  [[nodiscard]] double ambient(double seconds) const {
    const Daylight& d = scene.daylight;
    if (d.swing <= 0) return scene.ambient;
    return scene.ambient * (1 + d.swing * std::sin(2 * std::numbers::pi * seconds / d.period_s));
  }

  /// Linear light from a surface point towards the eye.
  [[nodiscard]] Vector3f shade(const Vector3f& p, const Vector3f& to_eye, const Hit& hit,
                               double seconds) const {
    const Material& m = *materials.at(hit.id);
    const auto moved = origins.find(hit.id);
    const Vector3f albedo = albedo_at(m, moved == origins.end() ? p : Vector3f(p - moved->second),
                                      hit.normal, scene.seed * 1000 + hit.id);
    Vector3f light = albedo * float(ambient(seconds));
    const Vector3f from = p + hit.normal * 1e-3F;
    // Which point of a lamp lights a point depends on the point alone: the grain of a penumbra then
    // lies on the surface, and both cameras see the same.
    constexpr float kGrain = 400;  // a 2.5 mm
    const std::uint64_t random =
        mix((std::uint64_t(std::uint32_t(int(std::floor(p.x() * kGrain)))) << 32U) ^
            (std::uint64_t(std::uint32_t(int(std::floor(p.y() * kGrain)))) << 13U) ^
            std::uint32_t(int(std::floor(p.z() * kGrain)))) +
        scene.seed;
    for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
      const Lamp& lamp = scene.lamps[i];
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

  /// `later` than the moment: what moves has moved on.
  [[nodiscard]] Eigen::Isometry3f T_map_camera(bool left, const Moment& moment,
                                               double later = 0) const {
    const StereoRig& rig = scene.camera.rig;
    Eigen::Vector2d at(moment.cart_m, moment.trolley_m);
    if (later != 0 && scene.motion.continuous)
      at +=
          gantry_at(scene.motion, moment.seconds + later) - gantry_at(scene.motion, moment.seconds);
    Eigen::Isometry3d mount = rig.T_map_camera_at_zero;
    if (scene.untold.any()) {
      // Turned about the mount's own place, not about the floor below it.
      const Eigen::Isometry3d moved = untold_at(scene.untold, at, moment.seconds + later);
      mount.linear() = moved.linear() * mount.linear();
      mount.translation() += moved.translation();
    }
    const Eigen::Isometry3d T = Eigen::Translation3d(at.x(), at.y(), 0) * mount *
                                (left ? rig.T_body_left : rig.T_body_right);
    return T.cast<float>();
  }

  ~Impl() {
    if (geometry != nullptr) rtcReleaseScene(geometry);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

Renderer::Renderer(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {
  impl_->device = rtcNewDevice("threads=1");
  expects(impl_->device != nullptr, "Embree starts");
  for (const auto& [name, material] : impl_->scene.materials)
    impl_->any_glass |= material.glass > 0;
  show(obstacles_at(scene, 0));
}

void Renderer::show(const std::vector<std::optional<SceneObstacle>>& obstacles) {
  Impl& m = *impl_;
  if (m.geometry != nullptr) rtcReleaseScene(m.geometry);
  m.geometry = rtcNewScene(m.device);
  rtcSetSceneFlags(m.geometry, RTC_SCENE_FLAG_ROBUST);
  m.materials.clear();
  m.origins.clear();
  m.add(floor_mesh(kFloorHalf, m.scene.pits), m.scene.materials.at(m.scene.floor_material), 0);
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    if (!obstacles[i]) continue;
    const auto id = static_cast<unsigned>(i + 1);
    m.add(mesh_of(*obstacles[i]), m.scene.materials.at(obstacles[i]->material), id);
    if (!obstacles[i]->texture_origin.isZero()) m.origins[id] = obstacles[i]->texture_origin;
  }
  rtcCommitScene(m.geometry);
}

Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

std::vector<Vector3f> Renderer::Impl::light(bool left, const Moment& moment) const {
  const CameraModel& camera = left ? scene.camera.rig.left : scene.camera.rig.right;
  const std::vector<Vector3f>& rays = left ? left_rays : right_rays;
  const Sensor& sensor = left ? left_sensor : right_sensor;
  const int samples = scene.camera.samples;
  // While the pixels of a row collect light, the camera moves.
  constexpr int kMoments = 8;
  const int moments = scene.camera.exposure_s > 0 ? kMoments : 1;
  std::vector<Vector3f> out(std::size_t(camera.width) * camera.height);
  parallel_rows(int(camera.height), [&](int row) {
    std::vector<Eigen::Isometry3f> poses;
    std::vector<double> times;
    for (int i = 0; i < moments; ++i) {
      const double exposed =
          moments > 1 ? ((i + 0.5) / moments - 0.5) * scene.camera.exposure_s : 0;
      const double read = (double(row) / camera.height - 0.5) * scene.camera.readout_s;
      times.push_back(moment.seconds + exposed + read);
      poses.push_back(T_map_camera(left, moment, exposed + read));
    }
    for (std::uint32_t u = 0; u < camera.width; ++u) {
      const std::size_t pixel = std::size_t(row) * camera.width + u;
      Vector3f sum = Vector3f::Zero();
      for (int s = 0; s < samples; ++s) {
        const std::size_t index = pixel * std::size_t(samples) + std::size_t(s);
        for (std::size_t i = 0; i < poses.size(); ++i) {
          const Vector3f direction = (poses[i].linear() * rays[index]).normalized();
          sum += look(poses[i].translation(), direction, times[i], 0);
        }
      }
      sum *= float(scene.camera.exposure) / float(samples * moments);
      if (!left && scene.camera.exposure_right != 1) sum *= float(scene.camera.exposure_right);
      if (sensor.dims()) sum *= sensor.gain_at(u, static_cast<std::uint32_t>(row));
      out[pixel] = sum;
    }
  });
  return out;
}

Image Renderer::render(bool left, double cart_m, double trolley_m, std::uint64_t frame,
                       double seconds) const {
  const Impl& m = *impl_;
  const CameraModel& camera = left ? m.scene.camera.rig.left : m.scene.camera.rig.right;
  const Sensor& sensor = left ? m.left_sensor : m.right_sensor;
  const std::vector<Vector3f> light = m.light(left, {cart_m, trolley_m, seconds});
  Image image{camera.width, camera.height, m.scene.camera.colour ? 3U : 1U, {}};
  image.bytes.resize(light.size() * image.channels);
  const std::uint64_t seed = m.noise_seed(left, frame);
  parallel_rows(int(camera.height), [&](int row) {
    for (std::size_t pixel = std::size_t(row) * camera.width;
         pixel < std::size_t(row + 1) * camera.width; ++pixel) {
      const auto level = [&](float linear, std::uint64_t channel) {
        return static_cast<std::uint8_t>(sensor.level(linear, seed + pixel * 4 + channel));
      };
      const Vector3f& l = light[pixel];
      std::uint8_t* out = image.bytes.data() + pixel * image.channels;
      if (image.channels == 1) {
        out[0] = level(brightness(l), 0);
      } else {
        out[0] = level(l.z(), 0);
        out[1] = level(l.y(), 1);
        out[2] = level(l.x(), 2);
      }
    }
  });
  return image;
}

std::vector<std::uint16_t> Renderer::render_deep(bool left, double cart_m, double trolley_m,
                                                 std::uint64_t frame, double seconds) const {
  const Impl& m = *impl_;
  const Sensor& sensor = left ? m.left_sensor : m.right_sensor;
  const std::vector<Vector3f> light = m.light(left, {cart_m, trolley_m, seconds});
  const std::uint64_t seed = m.noise_seed(left, frame);
  std::vector<std::uint16_t> out(light.size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<std::uint16_t>(sensor.level(brightness(light[i]), seed + i * 4));
  return out;
}

std::vector<float> Renderer::depth(double cart_m, double trolley_m, double seconds) const {
  const Impl& m = *impl_;
  const CameraModel& camera = m.scene.camera.rig.left;
  const std::vector<Vector3f> rays = camera_rays(camera, 1);
  const Eigen::Isometry3f T = m.T_map_camera(true, {cart_m, trolley_m, seconds});
  std::vector<float> out(rays.size());
  parallel_rows(int(camera.height), [&](int row) {
    for (std::uint32_t u = 0; u < camera.width; ++u) {
      const std::size_t i = std::size_t(row) * camera.width + u;
      // The ray's z component is 1: the distance in units of it is the depth.
      const Impl::Hit hit = m.trace(T.translation(), T.linear() * rays[i]);
      out[i] = hit.distance < kFar ? hit.distance : 0;
    }
  });
  return out;
}

double Renderer::height_m(double x_m, double y_m) const {
  constexpr float kAbove = 200;
  const Impl::Hit hit = impl_->trace(Vector3f(float(x_m), float(y_m), kAbove), Vector3f(0, 0, -1));
  return hit.distance < kFar ? double(kAbove - hit.distance) : 0;
}

bool Renderer::sees(double cart_m, double trolley_m, const Eigen::Vector3d& p_map) const {
  const Eigen::Isometry3f T = impl_->T_map_camera(true, {cart_m, trolley_m, 0});
  const CameraModel& c = impl_->scene.camera.rig.left;
  const Vector3f p = T.inverse() * p_map.cast<float>();
  if (p.z() <= 0.05F) return false;
  const double u = c.fx_px * p.x() / p.z() + c.cx_px;  // without the lens: a border of few pixels
  const double v = c.fy_px * p.y() / p.z() + c.cy_px;
  if (u < 0 || v < 0 || u > c.width - 1 || v > c.height - 1) return false;
  return !impl_->blocked(T.translation(), p_map.cast<float>() + Vector3f(0, 0, 1e-3F));
}

}  // namespace crane
