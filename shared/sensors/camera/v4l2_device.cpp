// SPDX-License-Identifier: Apache-2.0
#include "sensors/camera/v4l2_device.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace crane {
namespace {

constexpr std::uint32_t kBuffers = 4;
/// A picture's last rows equal to each other: what a lost USB packet leaves.
constexpr std::uint32_t kMostRepeatedRows = 8;

std::uint32_t pixel_format(PairLayout layout) {
  switch (layout) {
    case PairLayout::kSideBySideYuyv:
      return V4L2_PIX_FMT_YUYV;
    case PairLayout::kSideBySideGrey:
      return V4L2_PIX_FMT_GREY;
    case PairLayout::kInterleavedY8I:
      return V4L2_PIX_FMT_Y8I;
    case PairLayout::kSideBySideJpeg:
      return V4L2_PIX_FMT_MJPEG;
  }
  return 0;
}

std::string fourcc(std::uint32_t format) {
  std::string text;
  for (int n = 0; n < 4; ++n) {
    const char c = static_cast<char>((format >> (8 * n)) & 0x7FU);
    text += c >= ' ' && c < 0x7F ? c : '?';
  }
  return text;
}

std::string mode_text(std::uint32_t width, std::uint32_t height, std::uint32_t format) {
  return std::to_string(width) + " x " + std::to_string(height) + " " + fourcc(format);
}

v4l2_buffer empty_buffer() {
  v4l2_buffer b{};
  b.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  b.memory = V4L2_MEMORY_MMAP;
  return b;
}

}  // namespace

V4l2Device::V4l2Device(V4l2Options options, std::unique_ptr<V4l2Io> io,
                       std::function<ClockPair()> clocks)
    : options_(std::move(options)), io_(std::move(io)), clocks_(std::move(clocks)) {}

V4l2Device::~V4l2Device() {
  V4l2Device::close();
}

Error V4l2Device::trouble(int error, const std::string& doing) const {
  const auto say = [&](ErrorCode code, const std::string& what, const std::string& todo) {
    return Error{code, options_.path, what, todo};
  };
  switch (-error) {
    case EACCES:
    case EPERM:
      return say(ErrorCode::kResource, "this user may not open it",
                 "add the service's user to group video (SupplementaryGroups=video), and allow the "
                 "device (DeviceAllow=)");
    case EBUSY:
      return say(ErrorCode::kResource, "another program uses it",
                 "fuser " + options_.path + " says which: end it");
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return say(ErrorCode::kNotAvailable, "no camera is there (any more)",
                 "is it plugged in and powered? ls -l /dev/v4l/by-id gives its lasting name");
    default:
      return say(ErrorCode::kResource, doing + " failed: " + std::strerror(-error),
                 "unplug the camera and plug it in again; look at dmesg");
  }
}

Result<void> V4l2Device::open() {
  close();
  fd_ = io_->open(options_.path);
  if (fd_ < 0) return trouble(std::exchange(fd_, -1), "opening");
  for (auto step : {&V4l2Device::check_camera, &V4l2Device::set_mode, &V4l2Device::set_controls,
                    &V4l2Device::start})
    if (auto done = (this->*step)(); !done) return done;
  return {};
}

Result<void> V4l2Device::check_camera() {
  v4l2_capability c{};
  if (const int e = io_->ioctl(fd_, VIDIOC_QUERYCAP, &c); e < 0) {
    if (e != -ENOTTY && e != -EINVAL) return trouble(e, "asking what it is");
    return Error{ErrorCode::kConfiguration, options_.path, "is no video device",
                 "camera.path names the camera's /dev/video node; v4l2-ctl --list-devices"};
  }
  const std::uint32_t can =
      (c.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? c.device_caps : c.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0)
    return Error{
        ErrorCode::kConfiguration, options_.path,
        "gives no pictures: it is another node of the camera, such as that of its metadata",
        "name the camera's first node; v4l2-ctl --list-devices"};
  const auto* card = reinterpret_cast<const char*>(c.card);
  card_.assign(card, strnlen(card, sizeof c.card));
  return {};
}

/// Asks for the mode and looks at what was given: drivers change what they do not have, and say so
/// only in the answer.
Result<void> V4l2Device::set_mode() {
  const std::uint32_t wanted = pixel_format(options_.layout);
  // Y8I is a pixel of both images; all others stand side by side, or alone.
  const bool beside = options_.layout != PairLayout::kInterleavedY8I && !options_.single;
  const std::uint32_t width = beside ? 2 * options_.width : options_.width;
  v4l2_format f{};
  f.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  f.fmt.pix.width = width;
  f.fmt.pix.height = options_.height;
  f.fmt.pix.pixelformat = wanted;
  f.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int e = io_->ioctl(fd_, VIDIOC_S_FMT, &f); e < 0 && e != -EINVAL)
    return trouble(e, "setting its mode");
  else if (e == -EINVAL || f.fmt.pix.width != width || f.fmt.pix.height != options_.height ||
           f.fmt.pix.pixelformat != wanted)
    return Error{ErrorCode::kConfiguration, options_.path,
                 "does not have " + mode_text(width, options_.height, wanted) +
                     (e < 0 ? ""
                            : ", it gives " + mode_text(f.fmt.pix.width, f.fmt.pix.height,
                                                        f.fmt.pix.pixelformat)),
                 "set camera.width, height and layout to a mode that v4l2-ctl --list-formats-ext "
                 "shows; on USB 2 cameras have only their small ones"};
  row_bytes_ = f.fmt.pix.bytesperline;
  v4l2_streamparm p{};
  p.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  p.parm.capture.timeperframe = {1, static_cast<std::uint32_t>(options_.rate_hz)};
  const int e = io_->ioctl(fd_, VIDIOC_S_PARM, &p);
  if (e == -ENOTTY) return {};  // a camera of one rate
  if (e < 0) return trouble(e, "setting its rate");
  const auto& given = p.parm.capture.timeperframe;
  if (given.numerator * static_cast<std::uint32_t>(options_.rate_hz) != given.denominator)
    return Error{ErrorCode::kConfiguration, options_.path,
                 "does not have " + std::to_string(options_.rate_hz) +
                     " frames a second in this mode, but " + std::to_string(given.denominator) +
                     "/" + std::to_string(given.numerator),
                 "set camera.rate_hz to what v4l2-ctl --list-formats-ext shows"};
  return {};
}

Result<v4l2_queryctrl> V4l2Device::ask_control(std::uint32_t id, const char* name) {
  v4l2_queryctrl q{};
  q.id = id;
  const int e = io_->ioctl(fd_, VIDIOC_QUERYCTRL, &q);
  if (e < 0 && e != -EINVAL && e != -ENOTTY) return trouble(e, std::string("asking for ") + name);
  if (e < 0 || (q.flags & V4L2_CTRL_FLAG_DISABLED) != 0)
    return Error{ErrorCode::kConfiguration, options_.path,
                 std::string("has no ") + name + " to set",
                 std::string("leave ") + name + " and brightness of camera out"};
  return q;
}

Result<void> V4l2Device::set_control(std::uint32_t id, const char* name, int value) {
  const auto q = ask_control(id, name);
  if (!q) return q.error();
  if (value < q->minimum || value > q->maximum)
    return Error{ErrorCode::kConfiguration, options_.path,
                 std::string(name) + " " + std::to_string(value) + " is not within its " +
                     std::to_string(q->minimum) + " .. " + std::to_string(q->maximum),
                 std::string("change ") + name + " of camera"};
  v4l2_control c{id, value};
  if (const int e = io_->ioctl(fd_, VIDIOC_S_CTRL, &c); e < 0)
    return trouble(e, std::string("setting ") + name);
  return {};
}

Result<void> V4l2Device::set_exposure(int value) {
  return zed_ ? zed_->set_exposure(value)
              : set_control(V4L2_CID_EXPOSURE_ABSOLUTE, "exposure", value);
}

Result<void> V4l2Device::set_gain(int value) {
  return zed_ ? zed_->set_gain(value) : set_control(V4L2_CID_GAIN, "gain", value);
}

/// Of the ZED: by its registers. Left alone where nothing is to be set.
Result<void> V4l2Device::set_zed() {
  if (!options_.exposure && !options_.gain) return {};
  zed_.emplace(*io_, fd_, options_.path, options_.rate_hz);
  if (auto set = zed_->set_manual(); !set) return set;
  const int exposure = options_.exposure.value_or(zed_->longest_exposure() / 4);
  const int gain = options_.gain.value_or(0);
  if (auto set = zed_->set_exposure(exposure); !set) return set;
  if (auto set = zed_->set_gain(gain); !set) return set;
  if (options_.brightness && options_.exposure)
    control_.emplace(*options_.brightness, BrightnessControl::Range{0, exposure},
                     BrightnessControl::Range{0, ZedControls::kMostGain},
                     BrightnessControl::Setting{exposure, gain});
  return {};
}

Result<void> V4l2Device::set_controls() {
  control_.reset();
  zed_.reset();
  if (ZedControls::is_zed(card_)) return set_zed();
  const std::optional<int> exposure = options_.exposure;
  if (exposure) {
    // Not every camera has a mode of exposure: then there is only the value.
    v4l2_control manual{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL};
    (void)io_->ioctl(fd_, VIDIOC_S_CTRL, &manual);
    if (auto set = set_control(V4L2_CID_EXPOSURE_ABSOLUTE, "exposure", *exposure); !set) return set;
  }
  if (options_.gain)
    if (auto set = set_control(V4L2_CID_GAIN, "gain", *options_.gain); !set) return set;
  if (!options_.brightness || !exposure) return {};
  const auto time = ask_control(V4L2_CID_EXPOSURE_ABSOLUTE, "exposure");
  if (!time) return time.error();
  const auto gain = ask_control(V4L2_CID_GAIN, "gain");
  if (!gain) return gain.error();
  const int start = options_.gain.value_or(gain->minimum);
  if (auto set = set_control(V4L2_CID_GAIN, "gain", start); !set) return set;
  control_.emplace(*options_.brightness, BrightnessControl::Range{time->minimum, *exposure},
                   BrightnessControl::Range{gain->minimum, gain->maximum},
                   BrightnessControl::Setting{*exposure, start});
  return {};
}

/// Sets what keeps the next pairs neither dark nor saturated.
Result<void> V4l2Device::keep_brightness(const FrameBuffers& out, const FrameFacts& facts) {
  const auto next = control_->after(brightness_of(out, facts));
  if (control_->at_limit())
    remark_ = options_.path +
              ": exposure and gain are at their limits -> more or less light, or another "
              "camera.exposure_100us";
  if (!next) return {};
  if (auto set = set_exposure(next->exposure); !set) return set;
  return set_gain(next->gain);
}

Result<void> V4l2Device::start() {
  v4l2_requestbuffers r{};
  r.count = kBuffers;
  r.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  r.memory = V4L2_MEMORY_MMAP;
  if (const int e = io_->ioctl(fd_, VIDIOC_REQBUFS, &r); e < 0)
    return trouble(e, "asking for buffers");
  if (r.count < 2) return trouble(-ENOMEM, "asking for buffers");
  for (std::uint32_t n = 0; n < r.count; ++n) {
    v4l2_buffer b = empty_buffer();
    b.index = n;
    if (const int e = io_->ioctl(fd_, VIDIOC_QUERYBUF, &b); e < 0)
      return trouble(e, "asking for a buffer");
    auto* memory = static_cast<std::uint8_t*>(io_->map(fd_, b.length, b.m.offset));
    if (memory == nullptr) return trouble(-ENOMEM, "mapping a buffer");
    buffers_.push_back({memory, b.length});
    if (auto queued = give_back(b); !queued) return queued;
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int e = io_->ioctl(fd_, VIDIOC_STREAMON, &type); e < 0) {
    if (e == -ENOSPC)
      return Error{ErrorCode::kResource, options_.path, "the USB has no bandwidth left for it",
                   "give each camera a USB 3 controller of its own, or a smaller mode"};
    return trouble(e, "starting");
  }
  streaming_ = true;
  return {};
}

void V4l2Device::close() {
  if (fd_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (streaming_) (void)io_->ioctl(fd_, VIDIOC_STREAMOFF, &type);
  for (const Buffer& b : buffers_) io_->unmap(b.memory, b.length);
  io_->close(std::exchange(fd_, -1));
  buffers_.clear();
  streaming_ = false;
  last_sequence_.reset();
  missed_ = left_out_ = 0;
  remark_.clear();
}

Result<void> V4l2Device::give_back(v4l2_buffer buffer) {
  if (const int e = io_->ioctl(fd_, VIDIOC_QBUF, &buffer); e < 0)
    return trouble(e, "giving a buffer back");
  return {};
}

/// The newest frame that waits; older ones go back unread, counted.
Result<std::optional<v4l2_buffer>> V4l2Device::newest(DropCounts& dropped) {
  std::optional<v4l2_buffer> held;
  for (std::size_t n = 0; n <= buffers_.size(); ++n) {
    v4l2_buffer b = empty_buffer();
    const int e = io_->ioctl(fd_, VIDIOC_DQBUF, &b);
    if (e == -EAGAIN) break;
    if (e < 0) return trouble(e, "reading a frame");
    if (b.index >= buffers_.size()) return trouble(-EIO, "reading a frame");
    if (held) {
      dropped.add(Cause::kFrameOvertaken);
      ++left_out_;
      if (auto back = give_back(*held); !back) return back.error();
    }
    held = b;
  }
  return held;
}

/// False: counted and of no use.
bool V4l2Device::use(const v4l2_buffer& b, const FrameBuffers& out, FrameFacts& facts,
                     DropCounts& dropped) {
  const Stopwatch watch;
  if ((b.flags & V4L2_BUF_FLAG_ERROR) != 0) {
    dropped.add(Cause::kFrameCorrupt);
    remark_ =
        options_.path + ": the driver marks frames as damaged -> shorter cable, no hub, USB 3";
    return false;
  }
  const std::size_t bytes = std::min<std::size_t>(b.bytesused, buffers_[b.index].length);
  auto split = split_pair(options_.layout, buffers_[b.index].memory, bytes, options_.width,
                          options_.height, row_bytes_, options_.path, out, facts);
  if (!split) {
    dropped.add(split.error().code == ErrorCode::kWrongSize ? Cause::kFrameShort
                                                            : Cause::kFrameCorrupt);
    remark_ = split.error().text();
    return false;
  }
  const std::uint32_t pixel = bytes_per_pixel(facts.format);
  for (const std::uint8_t* image : {out.left, out.right})
    if (image != nullptr &&
        repeated_rows(image, facts.width, facts.height, pixel) > kMostRepeatedRows) {
      dropped.add(Cause::kFrameCorrupt);
      remark_ =
          options_.path +
          ": frames end in repeated rows, as after lost packets -> shorter cable, no hub, USB 3";
      return false;
    }
  if (options_.swap && !options_.single) {
    // The same picture, its halves named the other way round.
    const std::size_t size = std::size_t{facts.width} * facts.height * pixel;
    std::swap_ranges(out.left, out.left + size, out.right);
  }
  if (!options_.single && halves_swapped(out.left, out.right, facts.width, facts.height, pixel)) {
    dropped.add(Cause::kHalvesSwapped);
    remark_ = options_.path +
              ": left and right came the other way round -> if all frames do, set camera.swap";
    return false;
  }
  const TimeNs stamp = b.timestamp.tv_sec * kNsPerSecond + b.timestamp.tv_usec * 1000;
  if ((b.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC || stamp <= 0) {
    dropped.add(Cause::kExposureNotLater);
    remark_ =
        options_.path +
        ": the driver does not say when frames were taken -> this driver cannot be mapped with";
    return false;
  }
  const ClockPair now = clocks_();
  facts.number = b.sequence;
  facts.exposure_time = stamp + (now.epoch - now.monotonic) - options_.latency;
  facts.decode_ms = watch.ms();
  return true;
}

Result<bool> V4l2Device::grab(const FrameBuffers& out, FrameFacts& facts,
                              FrameSource::Deadline deadline, DropCounts& dropped) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
      deadline - std::chrono::steady_clock::now());
  const int ready = io_->wait(fd_, static_cast<int>(std::max<std::int64_t>(0, left.count())));
  if (ready < 0) return trouble(ready, "waiting for a frame");
  if (ready == 0) return false;
  auto frame = newest(dropped);
  if (!frame) return frame.error();
  if (!*frame) return false;
  const v4l2_buffer& b = **frame;
  remark_.clear();
  const bool good = use(b, out, facts, dropped);
  if (auto back = give_back(b); !back) return back.error();
  if (!good) {
    ++left_out_;
    return false;
  }
  const std::uint32_t step = last_sequence_ ? b.sequence - *last_sequence_ : 0;
  missed_ = step > 1 + left_out_ && step < 1'000'000 ? step - 1 - left_out_ : 0;
  last_sequence_ = b.sequence;
  left_out_ = 0;
  if (control_)
    if (auto kept = keep_brightness(out, facts); !kept) return kept.error();
  return true;
}

}  // namespace crane
