// SPDX-License-Identifier: Apache-2.0
#include "commission_answers.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <optional>

#include "base/format.hpp"
#include "base/read_file.hpp"
#include "base/write_file.hpp"
#include "child_output.hpp"
#include "config/yaml_reader.hpp"
#include "config/yaml_strict.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

constexpr int kLookMs = 100;  ///< between looks at whether it is to stop

struct Question {
  const char *key, *text, *standard;  ///< standard: of Enter alone; nullptr = there is none
};
constexpr Question kQuestions[] = {
    {"board",
     "Which board is held before the cameras? (chessboard:9x6:0.025 = inner corners, side "
     "of a square in metres; or charuco:..., aprilgrid:...)",
     nullptr},
    {"camera_height_m", "How high does the camera hang above the floor, by tape measure [m]?",
     nullptr},
    {"baseline_m", "How far apart are the two lenses, as the maker says [m]? (0 = not known)", "0"},
    {"board_images", "Folder with images of the board, or 'live' to take them now", "live"},
    {"start",
     "Where do bridge and trolley stand when the drive begins, X,Y [m] in the map? ('told' = "
     "the offsets of site.yaml stay)",
     "told"},
    {"drive_s", "For how many seconds will the crane be driven, over all of bridge and trolley?",
     "60"},
    {"object",
     "Where is an object of known height, and how high is it? X,Y,HEIGHT [m] in the map, "
     "the middle of its top",
     nullptr},
    {"object_wait_s", "For how many seconds at most will the crane be driven over it?", "120"},
    {"zones_right", "Are these all zones, and where they belong? (yes or no)", nullptr},
};

const Question& question_of(const std::string& key) {
  const auto found = std::find_if(std::begin(kQuestions), std::end(kQuestions),
                                  [&](const Question& q) { return key == q.key; });
  expects(found != std::end(kQuestions), "a question that is known");
  return *found;
}

Result<void> read(YamlReader file, std::map<std::string, std::string>& said) {
  for (const Question& q : kQuestions)
    if (std::string value; file.has(q.key)) {
      file.text(q.key, value, true);
      said[q.key] = value;
    }
  return file.finish();
}

/// A line of the terminal. False: it was closed, or this program is to stop.
bool read_line(std::string& line) {
  std::fflush(stdout);
  for (pollfd input{0, POLLIN, 0}; poll(&input, 1, kLookMs) == 0;)
    if (stop_requested()) return false;
  return !stop_requested() && std::getline(std::cin, line);
}

}  // namespace

Result<Answers> Answers::open(const std::string& file, const std::string& kept) {
  Answers out;
  out.kept_ = kept;
  out.terminal_ = file.empty() && isatty(0) != 0;
  for (const std::string& path : {kept, file}) {
    const auto there = is_there(path);
    if (!there) return there.error();
    if (path.empty() || (path == kept && !*there)) continue;
    auto yaml = YamlReader::from_file(path);
    if (!yaml) return yaml.error();
    if (auto good = read(std::move(*yaml), out.said_); !good) return good.error();
  }
  return out;
}

Result<std::string> Answers::text(const std::string& key) {
  if (const auto said = said_.find(key); said != said_.end()) return said->second;
  const Question& q = question_of(key);
  if (!terminal_) {
    if (q.standard != nullptr) return std::string(q.standard);
    return Error{ErrorCode::kConfiguration, "--answers", std::string("lack '") + key + "'",
                 std::string(q.text)};
  }
  std::string line;
  while (line.empty()) {
    std::printf("\n%s%s%s\n> ", q.text, q.standard != nullptr ? " Enter = " : "",
                q.standard != nullptr ? q.standard : "");
    if (!read_line(line)) return broken_off();
    if (line.empty() && q.standard != nullptr) line = q.standard;
  }
  said_[key] = line;
  if (auto done = keep(); !done) return done.error();
  return line;
}

Result<double> Answers::number(const std::string& key, double least, double most) {
  for (;;) {
    const auto said = text(key);
    if (!said) return said.error();
    const auto value = decimal_number(*said);
    if (value && *value >= least && *value <= most) return *value;
    const Error wrong{ErrorCode::kConfiguration, key,
                      "'" + *said + "' is not a number from " + formatted("%g to %g", least, most),
                      "write it with a decimal point, in the unit that its name ends with"};
    if (!terminal_) return wrong;
    std::printf("%s\n", wrong.text().c_str());
    forget(key);
  }
}

Result<void> Answers::ready(const std::string& what) {
  std::printf("%s\n", what.c_str());
  if (!terminal_) return {};
  std::printf("Enter when it is so> ");
  if (std::string line; !read_line(line)) return broken_off();
  return {};
}

bool Answers::again() {
  if (!terminal_) return false;
  std::printf("Try again? (y, or Enter to leave it for later)> ");
  std::string line;
  return read_line(line) && !line.empty() && (line[0] == 'y' || line[0] == 'Y');
}

void Answers::forget(const std::string& key) {
  said_.erase(key);
  if (terminal_) (void)keep();
}

Result<void> Answers::keep() const {
  std::string text;
  for (const auto& [key, value] : said_) {
    text += key + ": '";
    for (const char c : value) text += c == '\'' ? std::string("''") : std::string(1, c);
    text += "'\n";
  }
  return write_file(kept_, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace crane
