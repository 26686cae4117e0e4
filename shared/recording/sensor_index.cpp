// SPDX-License-Identifier: Apache-2.0
#include "recording/sensor_index.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/write_file.hpp"

namespace crane {
namespace {

Error cannot_write(const std::string& path, int why) {
  return {ErrorCode::kResource, path, "cannot be written: " + std::generic_category().message(why),
          "check permissions and free space"};
}

}  // namespace

Result<SensorIndex> SensorIndex::create(const std::string& path, const std::string& header,
                                        bool shrinks) {
  std::error_code failed;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failed);
  if (failed) return cannot_write(path, failed.value());
  SensorIndex index(path, header + "\n", shrinks);
  if (!shrinks) {
    index.file_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (index.file_ < 0) return cannot_write(path, errno);
    index.lines_.push_back({0, index.header_});
  }
  if (auto written = index.flush(); !written) return written.error();
  return index;
}

SensorIndex::~SensorIndex() {
  if (file_ >= 0) close(file_);
}

SensorIndex::SensorIndex(SensorIndex&& other) noexcept
    : path_(std::move(other.path_)),
      header_(std::move(other.header_)),
      shrinks_(other.shrinks_),
      changed_(other.changed_),
      file_(std::exchange(other.file_, -1)),
      good_bytes_(other.good_bytes_),
      lines_(std::move(other.lines_)) {}

void SensorIndex::add(TimeNs time, std::string text) {
  lines_.push_back({time, std::to_string(time) + "," + std::move(text) + "\n"});
  changed_ = true;
}

void SensorIndex::drop_before(TimeNs time) {
  while (shrinks_ && lines_.size() > 1 && lines_.front().time < time) {
    lines_.pop_front();
    changed_ = true;
  }
}

Result<void> SensorIndex::flush() {
  if (!changed_) return {};
  auto written = shrinks_ ? replace() : append();
  if (written) changed_ = false;
  return written;
}

Result<void> SensorIndex::append() {
  std::string text;
  for (const Line& line : lines_) text += line.text;
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t n = pwrite(file_, text.data() + done, text.size() - done,
                             static_cast<off_t>(good_bytes_) + static_cast<off_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int why = n < 0 ? errno : ENOSPC;
      // Half a line would be read as another time or distance.
      (void)(ftruncate(file_, static_cast<off_t>(good_bytes_)) == 0);
      return cannot_write(path_, why);
    }
    done += static_cast<std::size_t>(n);
  }
  good_bytes_ += static_cast<std::int64_t>(text.size());
  lines_.clear();
  return {};
}

Result<void> SensorIndex::replace() {
  std::string text = header_;
  for (const Line& line : lines_) text += line.text;
  return write_file(path_, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace crane
