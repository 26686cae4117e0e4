// SPDX-License-Identifier: Apache-2.0
// What the simulator can do to a camera, a surface and a recording.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numeric>

#include "recording/recording.hpp"
#include "sim/renderer.hpp"
#include "sim/sensor.hpp"
#include "sim/simulate.hpp"
#include "sim/surface.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

/// A small grey camera 4 m above textured concrete; `more` is YAML of the top level.
Scene scene_with(const std::string& more, const std::string& camera = "") {
  const test::TempFolder folder;
  std::ofstream(folder / "s.yaml")
      << "name: s\nseed: 3\ncamera: {resolution: [120, 80], f_px: 100, baseline_m: 0.3, height_m: "
         "4, "
         "noise_grey: 0, samples: 1, colour: false"
      << (camera.empty() ? "" : ", " + camera)
      << "}\nambient: 0.3\nfloor: concrete\nmaterials:\n"
         "  - {name: concrete, colour: [0.4, 0.4, 0.4], texture: 0.6, grain_m: 0.2}\n"
         "  - {name: plain, colour: [0.4, 0.4, 0.4], texture: 0}\n"
         "  - {name: mirror, colour: [0.4, 0.4, 0.4], texture: 0, mirror: 0.9}\n"
         "  - {name: glass, colour: [0.4, 0.4, 0.4], texture: 0, glass: 0.9}\n"
      << more;
  if (more.find("motion:") == std::string::npos)
    std::ofstream(folder / "s.yaml", std::ios::app)
        << "motion: {points: [{cart: 0, trolley: 0}, {cart: 0.5, trolley: 0}]}\n";
  auto scene = read_scene(folder / "s.yaml");
  EXPECT_TRUE(scene) << scene.error().text();
  return scene ? *scene : Scene{};
}

const std::string kLamp = "lamps: [{centre: [0.5, 0.5, 6], size: [0.4, 0.4], power: 12}]\n";

double mean(const Image& image) {
  return double(std::accumulate(image.bytes.begin(), image.bytes.end(), std::uint64_t{0})) /
         double(image.bytes.size());
}

double deviation(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.bytes.size(); ++i)
    sum += std::pow(double(a.bytes[i]) - double(b.bytes[i]), 2);
  return std::sqrt(sum / double(a.bytes.size()));
}

Image view(const Scene& scene, double seconds = 0, bool left = true, std::uint64_t frame = 0) {
  return Renderer(scene).render(left, 0, 0, frame, seconds);
}

int grey(const Image& image, std::size_t u, std::size_t v) {
  return image.bytes[v * image.width + u];
}

TEST(SceneShapes, RodsCablesChainsAndWedgesAreAsHighAsTheyAreSaidToBe) {
  const Renderer r(scene_with(
      "obstacles:\n"
      "  - {name: rod, kind: rod, material: plain, from: [-1, 0, 1], to: [1, 0, 2], radius: 0.05}\n"
      "  - {name: cable, kind: cable, material: plain, from: [-1, 1, 1], to: [1, 1, 1], sag: 0.4, "
      "radius: 0.02}\n"
      "  - {name: chain, kind: chain, material: plain, from: [-1, 2, 1], to: [1, 2, 1], radius: "
      "0.02}\n"
      "  - {name: ramp, kind: wedge, material: plain, x: 0, y: -1, low: 0, height: 1, size: [2, "
      "0.5]}\n"));
  EXPECT_NEAR(r.height_m(0, 0), 1.5 + 0.05 * std::sqrt(1.25), 0.002);
  EXPECT_NEAR(r.height_m(0, 0.06), 0, 1e-3) << "beside the rod";
  EXPECT_NEAR(r.height_m(0, 1), 0.6 + 0.02, 0.002) << "where the cable hangs lowest";
  EXPECT_NEAR(r.height_m(-0.5, -1), 0.25, 1e-3);
  EXPECT_NEAR(r.height_m(0.5, -1), 0.75, 1e-3);
  int iron = 0, air = 0;
  for (int i = -90; i < 90; ++i) (r.height_m(i * 0.01, 2) > 0.9 ? iron : air) += 1;
  EXPECT_GT(iron, 40);
  EXPECT_GT(air, 20) << "one sees through a chain";
}

TEST(SceneShapes, ThePointsInsideAreThoseBelowTheSurface) {
  const Scene scene = scene_with(
      "obstacles:\n"
      "  - {name: rod, kind: rod, material: plain, from: [-1, 0, 1], to: [1, 0, 2], radius: 0.05}\n"
      "  - {name: ramp, kind: wedge, material: plain, x: 0, y: -1, low: 0, height: 1, size: [2, "
      "0.5]}\n");
  EXPECT_EQ(scene.obstacles[0].shape.height_m, 2.05);
  EXPECT_TRUE(scene.obstacles[0].shape.is_line());
}

TEST(ScenePits, LieBelowTheFloorInTheTruthToo) {
  const Scene scene = scene_with("pits: [{from: [-0.5, -0.4], to: [0.6, 0.4], depth: 1.5}]\n");
  const Renderer r(scene);
  EXPECT_NEAR(r.height_m(0, 0), -1.5, 1e-3);
  EXPECT_NEAR(r.height_m(0.7, 0), 0, 1e-3);
  EXPECT_NEAR(r.depth(0, 0)[40 * 120 + 60], 5.5, 1e-3);
  const test::TempFolder folder;
  SimulateOptions options;
  options.folder = folder / "pit";
  options.truth_cell_m = 0.05;
  ASSERT_TRUE(simulate(scene, options));
  const auto truth = read_height_map(options.folder + "/truth/height_map.png");
  ASSERT_TRUE(truth) << truth.error().text();
  EXPECT_EQ(truth->offset_m, -2);
  double lowest = 1, highest = -9;
  for (std::size_t i = 0; i < truth->height_mm.size(); ++i)
    if (truth->seen(i)) {
      lowest = std::min(lowest, truth->height_m(i));
      highest = std::max(highest, truth->height_m(i));
    }
  EXPECT_NEAR(lowest, -1.5, 1e-3);
  EXPECT_NEAR(highest, 0, 1e-3);
}

TEST(Truth, KeepsWhatItIsToldOfLinesBasesAndWedges) {
  const test::TempFolder folder;
  TrueObstacle rod;
  rod.name = "rod", rod.kind = "rod", rod.radius_m = 0.02, rod.height_m = 2;
  rod.from_m = {1, 2, 0.5}, rod.to_m = {3, 4, 1.98};
  TrueObstacle fork;
  fork.name = "fork", fork.kind = "box", fork.size_x_m = 1, fork.size_y_m = 0.1;
  fork.height_m = 1.5, fork.base_m = 1.4;
  ASSERT_TRUE(write_obstacles(folder / "o.yaml", {rod, fork}));
  const auto read = read_obstacles(folder / "o.yaml");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ((*read)[0].to_m, rod.to_m);
  EXPECT_TRUE(std::isnan((*read)[0].base_m)) << "nobody said";
  EXPECT_EQ((*read)[1].base_m, 1.4);
  EXPECT_FALSE((*read)[1].is_line());
}

TEST(Surfaces, APatternRepeatsExactlyAndIsNoSameWithinAPeriod) {
  using Pattern = Material::Pattern;
  Material m;
  m.texture = 0;
  m.period_m = 0.25;
  const Eigen::Vector3f up(0, 0, 1);
  for (const Pattern p : {Pattern::kChecker, Pattern::kGrating, Pattern::kStripesX,
                          Pattern::kStripesY, Pattern::kBricks, Pattern::kDots}) {
    m.pattern = p;
    int dark = 0, bright = 0;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3f at(0.0137F * float(i % 20), 0.0173F * float(i / 20), 0);
      const float here = albedo_at(m, at, up, 1).x();
      (here < m.colour.x() ? dark : bright) += 1;
      // Two periods on: a checker's colours alternate.
      EXPECT_EQ(albedo_at(m, at + Eigen::Vector3f(0.5F, 0, 0), up, 1).x(), here) << int(p) << i;
    }
    EXPECT_GT(dark, 20) << int(p);
    EXPECT_GT(bright, 20) << int(p);
  }
}

TEST(Surfaces, APhotographLiesOnTheFloorNorthUp) {
  auto photo = std::make_shared<Image>(Image{4, 2, 3, std::vector<std::uint8_t>(24, 0)});
  for (int x = 0; x < 4; ++x) photo->bytes[std::size_t(3 * x + 2)] = 255;  // upper row red
  Material m;
  m.texture = 0;
  m.photo = photo;
  m.photo_m = 4;
  const auto colour = [&](float x, float y) { return albedo_at(m, {x, y, 0}, {0, 0, 1}, 1); };
  EXPECT_GT(colour(1, 2).x(), 0.9F);  // row 0 lies at y = 0, 2, ...
  EXPECT_LT(colour(1, 1).x(), 0.1F);
  EXPECT_LT(colour(1, 2).z(), 0.1F);
  // A photograph that is not there is a problem of its line.
  const test::TempFolder folder;
  std::ofstream(folder / "s.yaml") << "name: s\ncamera: {height_m: 2}\nfloor: a\n"
                                      "motion: {points: [{cart: 0, trolley: 0}]}\n"
                                      "materials: [{name: a, photo: nowhere.jpg}]\n";
  const auto scene = read_scene(folder / "s.yaml");
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().text().find("photo"), std::string::npos);
}

TEST(Surfaces, AMirrorShowsTheCeilingAndGlassTheFloor) {
  const auto with = [](const char* material) {
    return view(scene_with(kLamp + "obstacles: [{name: a, kind: box, material: " + material +
                           ", x: 0, y: 0, base: 0.9, height: 1, size: [20, 20]}]\n"));
  };
  const Image floor = view(scene_with(kLamp)), plain = with("plain"), glass = with("glass"),
              mirror = with("mirror");
  const auto contrast = [](const Image& i) {
    double sum = 0;
    for (std::size_t k = 1; k < i.bytes.size(); ++k) sum += std::abs(i.bytes[k] - i.bytes[k - 1]);
    return sum / double(i.bytes.size());
  };
  EXPECT_LT(contrast(plain), 0.3 * contrast(floor));
  EXPECT_GT(contrast(glass), 0.5 * contrast(floor));
  EXPECT_EQ(*std::max_element(mirror.bytes.begin(), mirror.bytes.end()), 255) << "the lamp";
}

TEST(Light, LampsSwitchAndDaylightSwells) {
  const Scene scene = scene_with(
      "lamps: [{centre: [0, 0, 6], power: 12, until_s: 2}]\ndaylight: {swing: 0.5, period_s: 8}\n");
  EXPECT_GT(mean(view(scene, 0)), mean(view(scene, 4)) + 20) << "the lamp is off";
  EXPECT_GT(mean(view(scene, 2)), mean(view(scene, 6)) + 10) << "the sun went";
}

TEST(Camera, VignettingAndExposureAreWhereTheyAreSaidToBe) {
  const Image even = view(scene_with(kLamp)), dim = view(scene_with(kLamp, "vignette: 0.8"));
  EXPECT_NEAR(grey(dim, 60, 40), grey(even, 60, 40), 3);
  EXPECT_LT(grey(dim, 0, 0), grey(even, 0, 0) * 0.7);
  const Scene mismatch = scene_with(kLamp, "exposure_right: 0.5");
  EXPECT_EQ(view(mismatch).bytes, even.bytes);
  EXPECT_LT(mean(view(mismatch, 0, false)), 0.85 * mean(view(scene_with(kLamp), 0, false)));
}

TEST(Camera, TheNoiseOfFewElectronsIsThatOfLightItself) {
  const auto noise = [](const char* electrons, const char* exposure) {
    const Scene s = scene_with(kLamp, std::string("full_well_e: ") + electrons +
                                          ", read_noise_e: 2, exposure: " + exposure);
    const Renderer r(s);
    return deviation(r.render(true, 0, 0, 1), r.render(true, 0, 0, 2));
  };
  const double many = noise("40000", "1"), few = noise("400", "1");
  EXPECT_NEAR(few / many, 10, 2) << "a hundredth of the light has a tenth of its precision";
  EXPECT_GT(many, 0.1);
}

TEST(Camera, OfTwelveBitsWritesSixteenBitFilesWithFinerGreys) {
  const Scene scene = scene_with(kLamp, "bits: 12");
  const std::vector<std::uint16_t> deep = Renderer(scene).render_deep(true, 0, 0, 0);
  EXPECT_GT(*std::max_element(deep.begin(), deep.end()), 255);
  EXPECT_LE(*std::max_element(deep.begin(), deep.end()), 4095);
  const test::TempFolder folder;
  SimulateOptions options;
  options.folder = folder / "r";
  options.max_frames = 1;
  options.truth_cell_m = 0.1;
  ASSERT_TRUE(simulate(scene, options));
  std::ifstream png(options.folder + "/cam0/data/1700000000000000000.png", std::ios::binary);
  std::string header(26, 0);
  png.read(header.data(), 26);
  EXPECT_EQ(int(header[24]), 16) << "bits a sample, in the PNG's own header";
}

TEST(Camera, MovingWhileItLooksBlursAndWhileItReadsShears) {
  const std::string motion =
      kLamp +
      "motion: {kind: timed, points: [{time_s: 0, cart: -2, trolley: 0}, {time_s: 4, cart: 2, "
      "trolley: 0}]}\n";
  const auto at = [&](const char* camera) {
    return Renderer(scene_with(motion, camera)).render(true, 0, 0, 0, 2);
  };
  const Image sharp = at(""), blurred = at("exposure_s: 0.2"), rolling = at("readout_s: 0.4");
  const auto edges = [](const Image& i) {
    double sum = 0;
    for (std::size_t k = 1; k < i.bytes.size(); ++k)
      sum += std::abs(int(i.bytes[k]) - int(i.bytes[k - 1]));
    return sum;
  };
  EXPECT_LT(edges(blurred), 0.8 * edges(sharp));
  EXPECT_GT(edges(rolling), 0.9 * edges(sharp));
  EXPECT_NEAR(grey(rolling, 60, 40), grey(sharp, 60, 40), 12) << "the middle row is on time";
  EXPECT_GT(deviation(rolling, sharp), 5);
}

TEST(Camera, DustDarkensAndDropsBend) {
  const Image clean = view(scene_with(kLamp)),
              dusty = view(scene_with(kLamp, "dust: 6, dust_radius_px: 10")),
              wet = view(scene_with(kLamp, "drops: 4, drop_radius_px: 10"));
  EXPECT_LT(mean(dusty), mean(clean) - 0.5);
  for (std::size_t i = 0; i < clean.bytes.size(); ++i) ASSERT_LE(dusty.bytes[i], clean.bytes[i]);
  EXPECT_GT(deviation(wet, clean), 3);
  const Image right = view(scene_with(kLamp, "drops: 4, drop_radius_px: 10"), 0, false);
  EXPECT_GT(deviation(right, wet), 3) << "each lens has its own";
}

TEST(Motion, NobodyTellsOfSwayAndVibration) {
  const Scene still = scene_with(kLamp);
  for (const char* what : {"skew_deg: 1", "sway_roll_deg: 1", "sway_pitch_deg: 1",
                           "vibration_deg: 1, vibration_hz: 3.3", "vibration_m: 0.05"}) {
    const Scene moving = scene_with(kLamp + "untold: {" + what + "}\n");
    EXPECT_GT(deviation(view(moving, 0.4), view(still, 0.4)), 2) << what;
  }
  EXPECT_TRUE(untold_at(still.untold, {1, 2}, 3).isApprox(Eigen::Isometry3d::Identity()));
  const Scene skew = scene_with("untold: {skew_deg_per_m: 2}\n");
  EXPECT_NEAR(Eigen::AngleAxisd(untold_at(skew.untold, {0, 3}, 0).linear()).angle(),
              6 * std::numbers::pi / 180, 1e-9);
}

TEST(Motion, AThingOnATrackTakesItsTextureAlong) {
  const Scene scene = scene_with(
      kLamp +
      "obstacles: [{name: a, kind: box, material: concrete, x: -1, y: 0, height: 0.5, size: [0.6, "
      "0.6], track: [{time_s: 0, x: -0.5, y: 0}, {time_s: 10, x: 0.5, y: 0}]}]\n");
  EXPECT_NEAR(obstacles_at(scene, 5)[0]->shape.x_m, 0, 1e-9);
  EXPECT_NEAR(obstacles_at(scene, 99)[0]->shape.x_m, 0.5, 1e-9);
  EXPECT_NEAR(obstacles_at(scene, 5)[0]->texture_origin.x(), 0.5F, 1e-6F);
}

TEST(Faults, OfUnknownKindsAndSensesAreRefusedWithTheKindsThereAre) {
  for (const char* text :
       {"toe_in", "toe_in=", "toe_in=a", "toe_in=nan", "toe_in=1e9", "toe=1", "=1", "toe_in=1x"}) {
    const auto fault = parse_fault(text);
    ASSERT_FALSE(fault) << text;
    EXPECT_NE(fault.error().text().find("drop_out"), std::string::npos);
  }
  EXPECT_EQ(parse_fault("trolley_outlier=-2")->value, -2);
}

TEST(Faults, OfCalibrationChangeWhatIsSaidOfTheRig) {
  const StereoRig rig = scene_with("").camera.rig;
  const auto told = [&](const char* text) { return told_rig(rig, {*parse_fault(text)}); };
  const double degree = std::numbers::pi / 180;
  for (const char* kind : {"toe_in", "roll", "pitch"}) {
    const StereoRig wrong = told((std::string(kind) + "=0.5").c_str());
    EXPECT_NEAR(Eigen::AngleAxisd(wrong.T_left_right.linear()).angle(), 0.5 * degree, 1e-9) << kind;
    EXPECT_TRUE(wrong.T_map_camera_at_zero.isApprox(rig.T_map_camera_at_zero));
  }
  for (const char* kind : {"tilt", "yaw"}) {
    const StereoRig wrong = told((std::string(kind) + "=2").c_str());
    EXPECT_NEAR(Eigen::AngleAxisd(wrong.T_map_camera_at_zero.linear() *
                                  rig.T_map_camera_at_zero.linear().transpose())
                    .angle(),
                2 * degree, 1e-9)
        << kind;
  }
  EXPECT_NEAR(told("height=0.05").camera_height_m(), 4.05, 1e-9);
  EXPECT_NEAR(told("baseline=0.01").T_left_right.translation().x(), 0.31, 1e-9);
  EXPECT_NEAR(told("focal=0.02").left.fx_px, 102, 1e-9);
  EXPECT_NEAR(told("principal=3").right.cx_px, rig.right.cx_px + 3, 1e-9);
  EXPECT_NEAR(told("distortion=-0.1").right.k1, -0.1, 1e-9);
}

TEST(Faults, OfRangefindersChangeTheReadingsTheyAreSaidTo) {
  std::vector<RecordedDistance> good;
  for (int i = 0; i < 100; ++i) good.push_back({i * 50 * kNsPerSecond / 1000, 5 + 0.01 * i});
  const TimeNs middle = good[50].time + 10;
  const auto spoiled = [&](const char* text, bool cart = true) {
    auto readings = good;
    spoil(readings, {*parse_fault(text)}, cart, middle);
    return readings;
  };
  const auto changed = [&](const std::vector<RecordedDistance>& r) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < r.size(); ++i) n += r[i].distance_m != good[i].distance_m;
    return n;
  };
  EXPECT_EQ(changed(spoiled("zero=3")), 3U);
  EXPECT_EQ(spoiled("zero=1")[50].distance_m, 0);
  EXPECT_EQ(changed(spoiled("outlier=2")), 1U);
  EXPECT_NEAR(spoiled("outlier=2")[50].distance_m, good[50].distance_m + 2, 1e-9);
  EXPECT_EQ(changed(spoiled("jump=0.3")), 49U);
  EXPECT_EQ(changed(spoiled("offset=0.3")), 100U);
  EXPECT_NEAR(spoiled("scale=0.1")[99].distance_m, 1.1 * good[99].distance_m, 1e-9);
  EXPECT_NEAR(spoiled("direction=30")[0].distance_m, 25, 1e-9);
  EXPECT_EQ(spoiled("drop_out=1").size(), 80U);
  EXPECT_EQ(spoiled("delay=20")[7].time, good[7].time + 20 * kNsPerSecond / 1000);
  EXPECT_EQ(changed(spoiled("trolley_outlier=2")), 0U) << "of the other axis";
  EXPECT_EQ(changed(spoiled("trolley_outlier=2", false)), 1U);
}

TEST(Faults, AreInWhatIsWrittenAndNotInWhatIsSeen) {
  const Scene scene = scene_with(kLamp);
  const test::TempFolder folder;
  const auto bytes = [](const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  for (const bool faulty : {false, true}) {
    SimulateOptions options;
    options.folder = folder / (faulty ? "faulty" : "true");
    options.truth_cell_m = 0.1;
    if (faulty) options.faults = {*parse_fault("toe_in=0.2"), *parse_fault("offset=0.5")};
    ASSERT_TRUE(simulate(scene, options));
  }
  const auto a = Recording::open(folder / "true"), b = Recording::open(folder / "faulty");
  ASSERT_TRUE(a);
  ASSERT_TRUE(b);
  EXPECT_FALSE(a->rig().T_left_right.isApprox(b->rig().T_left_right));
  EXPECT_NEAR(b->cart()[0].distance_m - a->cart()[0].distance_m, 0.5, 1e-4);
  for (const char* file : {"/cam1/data/1700000000000000000.jpg", "/truth/height_map.png"})
    EXPECT_EQ(bytes((folder / "true") + file), bytes((folder / "faulty") + file)) << file;
}

TEST(QuickScenes, SeeTheMiddleOfTheImageAsLargeAsBefore) {
  Scene scene = scene_with(kLamp + "quick: {resolution: [60, 40], frames: 1}\n");
  const Image whole = view(scene);
  const Scene quick = make_quick(scene);
  const Image part = view(quick);
  ASSERT_EQ(part.width, 60U);
  EXPECT_EQ(quick.motion.points.size(), 1U);
  for (std::size_t v = 0; v < 40; ++v)
    for (std::size_t u = 0; u < 60; ++u)
      ASSERT_NEAR(grey(part, u, v), grey(whole, u + 30, v + 20), 1);
}

}  // namespace
}  // namespace crane
