// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "base/write_file.hpp"
#include "calibrate_command.hpp"
#include "calibration/find_board.hpp"
#include "calibration/guidance.hpp"
#include "calibration/image_pairs.hpp"
#include "calibration/report.hpp"
#include "calibration/stereo_calibration.hpp"
#include "live_views.hpp"
#include "progress.hpp"
#include "recording/calibration.hpp"
#include "recording/image_file.hpp"
#include "service/exit_code.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostPixels = 64'000'000;
constexpr double kRate_Hz = 10;  ///< written for who reads the folder as a recording

struct Options {
  std::string images, board, out, live;
  double height_m = 0;
  int enough = 20;  ///< views of a live camera
  StereoCalibrationOptions calibration;
};

/// What was found in the images.
struct Found {
  std::vector<View> views;
  std::vector<RejectedView> rejected;
  ImageSize size;
};

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

/// Reads one image and finds the board; sets `why` where there is none.
Result<Corners> corners_of(const std::string& path, const BoardFinder& finder, ImageSize& size,
                           std::string& why) {
  if (path.empty()) {
    why = "missing";
    return Corners{};
  }
  const auto image = read_image(path, kMostPixels);
  if (!image) {
    why = image.error().what;
    return Corners{};
  }
  if (size.width == 0) size = {image.value().width, image.value().height};
  if (size.width != image.value().width || size.height != image.value().height)
    return Error{ErrorCode::kConfiguration, path,
                 "is " + std::to_string(image.value().width) + " x " +
                     std::to_string(image.value().height) + ", the images before are " +
                     std::to_string(size.width) + " x " + std::to_string(size.height),
                 "calibrate with images of one size, that of the camera in service"};
  Corners corners = finder.find(image.value());
  if (corners.empty()) why = "no board";
  return corners;
}

/// None shows the board: perhaps another one was meant.
Error no_board(const std::vector<ImagePair>& pairs, const Board& board, const BoardFinder& finder) {
  std::string todo =
      "count the inner corners, not the squares; the whole board must be in the "
      "image, with a white border";
  for (const ImagePair& pair : pairs) {
    const auto image = read_image(pair.left.empty() ? pair.right : pair.left, kMostPixels);
    if (!image) continue;
    if (const std::string other = finder.other_board(image.value()); !other.empty()) {
      todo = "a chessboard of " + other + " inner corners is there: is that --board?";
      break;
    }
    if (&pair == &pairs[std::min<std::size_t>(4, pairs.size() - 1)]) break;
  }
  return {ErrorCode::kBadData, board.text(), "is in none of the images", todo};
}

Result<Found> find_views(const std::vector<ImagePair>& pairs, const Board& board,
                         const BoardFinder& finder) {
  Found found;
  Progress progress("looking for the board");
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ImagePair& pair = pairs[i];
    View view{pair.name, {}, {}};
    std::string why[2];
    auto left = corners_of(pair.left, finder, found.size, why[0]);
    if (!left) return left.error();
    auto right = corners_of(pair.right, finder, found.size, why[1]);
    if (!right) return right.error();
    view.left = left.value();
    view.right = right.value();
    if (view.left.empty() && view.right.empty())
      found.rejected.push_back({pair.name, "left image: " + why[0] + "; right image: " + why[1]});
    else
      found.views.push_back(std::move(view));
    progress.update(i + 1, pairs.size(), "pairs");
    if (stop_requested()) return Error{ErrorCode::kNotAvailable, "calibrate", "stopped", ""};
  }
  progress.finish(board.text() + " found in " + std::to_string(found.views.size()) + " of " +
                  std::to_string(pairs.size()) + " pairs");
  if (found.views.empty()) return no_board(pairs, board, finder);
  return found;
}

CameraModel camera_of(const LensNumbers& l, const ImageSize& size, LensFit fit) {
  CameraModel camera{size.width, size.height, l[0], l[1], l[2], l[3], l[4], l[5], l[6], l[7]};
  camera.lens = fit == LensFit::kRational ? LensModel::kRational : LensModel::kRadialTangential;
  camera.k3 = l[8];
  camera.k4 = l[9];
  camera.k5 = l[10];
  camera.k6 = l[11];
  return camera;
}

/// A rig whose camera looks straight down from --height, the image's x along the runway, until
/// the mount is calibrated.
StereoRig rig_of(const StereoCalibration& c, const Options& options) {
  StereoRig rig;
  rig.left = camera_of(c.rig.left, c.size, options.calibration.model);
  rig.right = camera_of(c.rig.right, c.size, options.calibration.model);
  rig.T_left_right = c.rig.T_right_left.inverse();
  rig.T_map_camera_at_zero.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  rig.T_map_camera_at_zero.translation() = Eigen::Vector3d(0, 0, options.height_m);
  return rig;
}

void print(const StereoCalibration& c) {
  static constexpr const char* kVerdict[] = {"GOOD", "USABLE", "BAD"};
  std::printf("%s: heights of a floor at %.1f m sure to %.2f cm (1 sigma, in 95 %% of the image)\n",
              kVerdict[static_cast<int>(c.verdict)], c.floor_m, 100 * c.height_sigma_m.most());
  std::printf("baseline %.2f +- %.2f mm; corners to %.3f px; %zu views used, %zu rejected\n",
              1000 * c.rig.baseline_m(), 1000 * c.rig.baseline_sigma_m(), c.rig.sigma_px,
              c.views.size(), c.rejected.size());
  for (const RejectedView& view : c.rejected)
    std::printf("  rejected %s: %s\n", view.name.c_str(), view.reason.c_str());
  for (const std::string& remark : c.remarks) std::printf("  - %s\n", remark.c_str());
  if (const auto next = next_view(c.coverage)) std::printf("next view: %s\n", next->words.c_str());
}

/// The images to calibrate from; those of a running camera are taken first.
Result<std::string> images_of(const Options& options, const Board& board,
                              const BoardFinder& finder) {
  if (options.live.empty() != options.images.empty()) {
    if (options.live.empty()) return options.images;
    const std::string folder = options.out + "/images";
    const auto taken = is_there(folder);
    if (!taken) return taken.error();
    if (taken.value())
      return Error{ErrorCode::kConfiguration, folder, "is there already",
                   "calibrate from it (IMAGES), or give --out a new folder"};
    if (auto done = collect_live_views(options.live, board, finder, folder, options.enough); !done)
      return done.error();
    if (stop_requested())
      return Error{ErrorCode::kNotAvailable, folder, "holds the views that were kept",
                   "calibrate from them: give the folder instead of --live"};
    return folder;
  }
  return Error{ErrorCode::kConfiguration, "calibrate stereo", "wants images or a running camera",
               "give a folder, or --live site.yaml, one of both"};
}

int run_stereo(const Options& options) {
  const auto board = parse_board(options.board);
  if (!board) return fail(board.error());
  const auto finder = BoardFinder::of(board.value());
  if (!finder) return fail(finder.error());
  const auto taken = is_there(options.out + "/cam0");
  if (!taken) return fail(taken.error());
  if (taken.value())
    return fail(Error{ErrorCode::kConfiguration, options.out, "holds a calibration already",
                      "give --out a new folder"});
  const auto images = images_of(options, board.value(), finder.value());
  if (!images) return fail(images.error());
  const auto pairs = find_image_pairs(images.value());
  if (!pairs) return fail(pairs.error());
  auto found = find_views(pairs.value(), board.value(), finder.value());
  if (!found) return fail(found.error());

  auto calibration =
      calibrate_stereo(found->views, board.value(), found->size, options.calibration);
  if (!calibration) {
    if (const auto next = next_view(rough_coverage(found->views, board.value(), found->size)))
      std::printf("next view: %s\n", next->words.c_str());
    return fail(calibration.error());
  }
  calibration->rejected.insert(calibration->rejected.begin(), found->rejected.begin(),
                               found->rejected.end());

  Image pair;
  for (const ImagePair& each : pairs.value())
    if (each.name == calibration->views.front().name && !each.left.empty() && !each.right.empty()) {
      const auto left = read_image(each.left, kMostPixels);
      const auto right = read_image(each.right, kMostPixels);
      if (left && right) pair = rectified_pair(*calibration, left.value(), right.value());
    }
  const std::string page = report_page(*calibration, images.value(), pair);
  std::error_code failed;
  fs::create_directories(options.out, failed);
  const std::string report = options.out + "/report.html";
  if (auto done =
          write_file(report, reinterpret_cast<const std::uint8_t*>(page.data()), page.size());
      !done)
    return fail(done.error());
  print(*calibration);
  if (calibration->verdict == CalibrationVerdict::kBad)
    return fail(Error{ErrorCode::kBadData, images.value(),
                      "gives no calibration that a map may be made with", "see " + report});
  if (auto done = write_rig(rig_of(*calibration, options), options.out, kRate_Hz); !done)
    return fail(done.error());
  std::printf("calibration in %s, report in %s\n", options.out.c_str(), report.c_str());
  return kExitOk;
}

}  // namespace

std::function<int()> add_stereo_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* stereo = app.add_subcommand(
      "stereo",
      "Lenses and relation of the two cameras, from images of a board, with how surely.\n"
      "Take 20 to 40 pairs: the board in all parts of both images, near enough to fill half of\n"
      "them, tilted by 30 to 45 degrees in all directions, and at rest.\n"
      "Example: cranemap calibrate stereo images --board chessboard:9x6:0.025 --height 9.4 "
      "--out deploy/sites/crane-1/calibration");
  stereo->add_option(
      "IMAGES", options->images,
      "Folder with left*.png and right*.png (also left/ and right/, cam0/ and cam1/)");
  stereo
      ->add_option(
          "--live", options->live,
          "Instead of IMAGES: the camera of this site.yaml; says of each view whether it is "
          "kept, and what the next one should show")
      ->check(CLI::ExistingFile);
  stereo->add_option("--views", options->enough, "Of --live: at least so many")
      ->check(CLI::Range(8, 200))
      ->capture_default_str();
  stereo
      ->add_option("--board", options->board,
                   "chessboard:9x6:0.025 (inner corners, square in metres),\n"
                   "charuco:11x8:0.03:0.022:5X5_100 (and marker, dictionary),\n"
                   "aprilgrid:6x6:0.088:0.3 (tags, side in metres, gap as a part of it)")
      ->required();
  stereo->add_option("--out", options->out, "Folder of the new calibration and its report")
      ->required();
  stereo
      ->add_option("--height", options->height_m,
                   "Of the camera above the floor [m]; the camera is taken to look straight down")
      ->required()
      ->check(CLI::Range(0.3, 100.0));
  stereo
      ->add_option("--baseline", options->calibration.baseline_m,
                   "Distance of the cameras as the maker says [m]; shows a board measured wrong")
      ->check(CLI::Range(0.005, 5.0));
  static const std::map<std::string, LensFit> kLenses = {{"k1k2", LensFit::kRadialTangential},
                                                         {"k3", LensFit::kWithK3},
                                                         {"rational", LensFit::kRational}};
  stereo
      ->add_option("--lens", options->calibration.model,
                   "What is estimated of each lens: k1k2 (and p1, p2; most lenses), k3 (and k3),\n"
                   "rational (and k4, k5, k6; wide ones; wants many views)")
      ->transform(CLI::CheckedTransformer(kLenses))
      ->default_str("k1k2");
  return [options] {
    Options o = *options;
    o.calibration.floor_m = o.height_m;
    return run_stereo(o);
  };
}

}  // namespace crane
