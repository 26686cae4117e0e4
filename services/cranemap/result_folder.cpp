// SPDX-License-Identifier: Apache-2.0
#include "result_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr const char* kServices[] = {"mapper", "stereo", "rangefinder", "camera", "clearance"};
constexpr std::string_view kFirstLine =
    "results of cranemap run: the next run here replaces them\n";
constexpr std::string_view kRunning = "running\n", kFinished = "finished\n";

Error foreign(const std::string& path, const std::string& what) {
  return {ErrorCode::kConfiguration, path, what,
          "give --out a new or empty folder, or that of an earlier run; nothing was changed"};
}

Error unwritable(const std::string& path, int why) {
  return {ErrorCode::kResource, path, "cannot be written: " + std::generic_category().message(why),
          "give --out a folder on a disk with free space that you may write"};
}

/// Of the marker; empty when it is none of ours.
std::string read_marker(int file) {
  std::array<char, 256> text{};
  const ssize_t size = pread(file, text.data(), text.size(), 0);
  if (size <= 0) return {};
  const std::string_view all(text.data(), static_cast<std::size_t>(size));
  return all.starts_with(kFirstLine) ? std::string(all.substr(kFirstLine.size())) : std::string();
}

/// Whether a run of a version without markers made all that is there.
bool made_before_markers(const fs::path& folder) {
  std::ifstream file(folder / "report.json");
  const auto report = nlohmann::json::parse(file, nullptr, false);
  if (!report.is_object() || !report.contains("cranemap") || !report.contains("run")) return false;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed);
  for (const fs::directory_iterator none; !failed && entry != none; entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    const auto* end = std::end(ResultFolder::kResults);
    if (name != "logs" && std::find(std::begin(ResultFolder::kResults), end, name) == end)
      return false;
  }
  return !failed;
}

}  // namespace

Result<ResultFolder> ResultFolder::claim(const std::string& path) {
  if (path.empty()) return foreign("--out", "names no folder");
  std::error_code failed;
  fs::create_directories(path, failed);
  if (failed) return unwritable(path, failed.value());
  if (!fs::is_directory(path, failed)) return unwritable(path, failed ? failed.value() : ENOTDIR);
  const fs::path marker = fs::path(path) / kMarker;
  const bool known = fs::is_regular_file(fs::symlink_status(marker, failed));
  if (!known) {
    const fs::directory_iterator first(path, failed);
    if (failed) return unwritable(path, failed.value());
    if (first != fs::directory_iterator() && !made_before_markers(path))
      return foreign(path,
                     "holds files that no run made ('" + first->path().filename().string() + "')");
  }
  const int file = open(marker.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
  if (file < 0) return unwritable(path, errno);
  ResultFolder folder(path, file);
  if (flock(file, LOCK_EX | LOCK_NB) != 0) return foreign(path, "is in use by another run");
  if (known) {
    const std::string earlier = read_marker(file);
    if (earlier != kRunning && earlier != kFinished)
      return foreign(path, std::string("holds a ") + kMarker + " that no run wrote");
    // A run that ended took its state with it: one that is there now is of a mapper that serves.
    if (earlier == kFinished && fs::exists(folder.state(), failed))
      return foreign(path, "holds a folder 'state' that no run made");
  }
  if (!folder.write_marker(kRunning.data())) return unwritable(path, errno);
  for (const char* name : kResults) fs::remove(fs::path(path) / name, failed);
  for (const char* service : kServices)
    fs::remove(fs::path(path) / "logs" / (std::string(service) + ".log"), failed);
  fs::remove_all(folder.state(), failed);
  fs::create_directories(fs::path(path) / "logs", failed);
  if (failed) return unwritable(path, failed.value());
  return folder;
}

ResultFolder::ResultFolder(ResultFolder&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

ResultFolder::~ResultFolder() {
  if (lock_ >= 0) close(lock_);
}

std::string ResultFolder::state() const {
  return (fs::path(path_) / "state").string();
}

void ResultFolder::finish() {
  std::error_code ignored;
  fs::remove_all(state(), ignored);
  (void)write_marker(kFinished.data());
}

bool ResultFolder::write_marker(const char* state) const {
  const std::string text = std::string(kFirstLine) + state;
  if (pwrite(lock_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) return false;
  return ftruncate(lock_, static_cast<off_t>(text.size())) == 0;
}

}  // namespace crane
