// SPDX-License-Identifier: Apache-2.0
#include "sim/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <thread>

#include "sim/lit_scene.hpp"
#include "sim/noise.hpp"
#include "sim/sensor.hpp"

namespace crane {
namespace {

using Eigen::Vector3f;

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
          const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
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
  LitScene lit;
  const Scene& scene;
  Sensor left_sensor, right_sensor;
  std::vector<Vector3f> left_rays, right_rays;

  explicit Impl(const Scene& of)
      : lit(of),
        scene(lit.scene()),
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
    Eigen::Isometry3d T = Eigen::Translation3d(at.x(), at.y(), 0) * mount;
    if (!left) T = T * rig.T_left_right;
    return T.cast<float>();
  }
};

Renderer::Renderer(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}

void Renderer::show(const std::vector<std::optional<SceneObstacle>>& obstacles) {
  impl_->lit.show(obstacles);
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
          sum += lit.look(poses[i].translation(), direction, times[i], 0);
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
      const LitScene::Hit hit = m.lit.trace(T.translation(), T.linear() * rays[i]);
      out[i] = hit.distance < LitScene::kFar ? hit.distance : 0;
    }
  });
  return out;
}

double Renderer::height_m(double x_m, double y_m) const {
  constexpr float kAbove = 200;
  const LitScene::Hit hit =
      impl_->lit.trace(Vector3f(float(x_m), float(y_m), kAbove), Vector3f(0, 0, -1));
  return hit.distance < LitScene::kFar ? double(kAbove - hit.distance) : 0;
}

bool Renderer::sees(double cart_m, double trolley_m, const Eigen::Vector3d& p_map) const {
  const Eigen::Isometry3f T = impl_->T_map_camera(true, {cart_m, trolley_m, 0});
  const CameraModel& c = impl_->scene.camera.rig.left;
  const Vector3f p = T.inverse() * p_map.cast<float>();
  if (p.z() <= 0.05F) return false;
  const double u = c.fx_px * p.x() / p.z() + c.cx_px;  // without the lens: a border of few pixels
  const double v = c.fy_px * p.y() / p.z() + c.cy_px;
  if (u < 0 || v < 0 || u > c.width - 1 || v > c.height - 1) return false;
  return !impl_->lit.blocked(T.translation(), p_map.cast<float>() + Vector3f(0, 0, 1e-3F));
}

}  // namespace crane
