// SPDX-License-Identifier: Apache-2.0
#include "live_views.hpp"

#include <cstdio>
#include <filesystem>

#include "base/format.hpp"
#include "calibration/guidance.hpp"
#include "camera_pairs.hpp"
#include "output.hpp"
#include "recording/image_file.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

constexpr double kPatience_s = 10;

/// A line, unless it says what the line before said.
class Says {
 public:
  void operator()(const std::string& text) {
    if (text == last_) return;
    std::printf("%s\n", text.c_str());
    flush_output();
    last_ = text;
  }

 private:
  std::string last_;
};

}  // namespace

Result<void> collect_live_views(const std::string& config, const Board& board,
                                const BoardFinder& finder, const std::string& folder, int enough) {
  auto site = read_site_config(config);
  if (!site) return site.error();
  auto camera = CameraPairs::open(*site);
  if (!camera) return camera.error();
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  std::optional<ViewGate> gate;
  ImageSize size;
  Says say;
  say("looking for the board; what is kept goes to " + folder);
  while (!stop_requested()) {
    auto pair = camera->next(kPatience_s);
    if (stop_requested()) break;
    if (!pair) return pair.error();
    if (!gate) {
      size = {pair->left.width, pair->left.height};
      gate.emplace(board, size);
    }
    View view{"", finder.find(pair->left), finder.find(pair->right)};
    same_order(board, view);
    if (const std::string why = gate->refuse(view); !why.empty()) {
      say("  not kept: " + why);
      continue;
    }
    const std::string name = formatted("%02zu.png", gate->kept().size());
    if (auto done = write_image(folder + "/left" + name, pair->left); !done) return done;
    if (auto done = write_image(folder + "/right" + name, pair->right); !done) return done;
    const auto next = next_view(rough_coverage(gate->kept(), board, size));
    say(formatted("view %zu kept; ", gate->kept().size()) +
        (next ? "next: " + next->words : std::string("all parts and tilts are there")));
    if (!next && gate->kept().size() >= static_cast<std::size_t>(enough)) break;
  }
  return {};
}

}  // namespace crane
