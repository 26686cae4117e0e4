#pragma once

#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "sensors/camera/v4l2_io.hpp"

namespace crane::test {

/// A UVC camera in the process that answers as drivers do, and lies as they do. Outlives the device
/// that uses it: see FakeV4l2::io().
struct FakeCamera {
  // What it is.
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::uint32_t format = V4L2_PIX_FMT_YUYV, width = 64, height = 16, rate_hz = 15;
  std::uint32_t padding = 0;  ///< bytes behind each row
  bool has_gain = true;
  // What goes wrong, from now on; 0: nothing.
  int open_error = 0, query_error = 0, format_error = 0, stream_error = 0, dequeue_error = 0;

  struct Frame {
    std::vector<std::uint8_t> bytes;
    std::int64_t stamp_us = 0;
    std::uint32_t sequence = 0;
    std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  };
  std::deque<Frame> frames;  ///< to be delivered

  // What was done with it.
  int opens = 0, closes = 0, maps = 0, unmaps = 0;
  bool streaming = false;
  std::map<std::uint32_t, int> controls;
  std::vector<std::vector<std::uint8_t>> memory;
  std::deque<std::uint32_t> queued;

  [[nodiscard]] std::uint32_t row_bytes() const {
    const bool two = format == V4L2_PIX_FMT_YUYV || format == V4L2_PIX_FMT_Y8I;
    return width * (two ? 2 : 1) + padding;
  }
};

class FakeV4l2 final : public V4l2Io {
 public:
  explicit FakeV4l2(FakeCamera& camera) : c_(camera) {}
  int open(const std::string&) override {
    if (c_.open_error != 0) return -c_.open_error;
    ++c_.opens;
    return 5;
  }
  void close(int) override {
    ++c_.closes;
    c_.streaming = false;
    c_.queued.clear();
  }
  void* map(int, std::size_t length, std::size_t offset) override {
    ++c_.maps;
    return length <= c_.memory.at(offset).size() ? c_.memory[offset].data() : nullptr;
  }
  void unmap(void*, std::size_t) override { ++c_.unmaps; }
  int wait(int, int) override { return c_.frames.empty() && c_.dequeue_error == 0 ? 0 : 1; }

  int ioctl(int, unsigned long request, void* argument) override {
    switch (request) {
      case VIDIOC_QUERYCAP: {
        if (c_.query_error != 0) return -c_.query_error;
        auto& a = *static_cast<v4l2_capability*>(argument);
        a.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_DEVICE_CAPS;
        a.device_caps = c_.capabilities;  // of this node; the others are the whole device's
        return 0;
      }
      case VIDIOC_S_FMT: {
        if (c_.format_error != 0) return -c_.format_error;
        auto& p = static_cast<v4l2_format*>(argument)->fmt.pix;
        p.width = c_.width;  // whatever was asked for
        p.height = c_.height;
        p.pixelformat = c_.format;
        p.bytesperline = c_.format == V4L2_PIX_FMT_MJPEG ? 0 : c_.row_bytes();
        p.sizeimage = c_.row_bytes() * c_.height + 1024;
        c_.memory.clear();
        return 0;
      }
      case VIDIOC_S_PARM:
        static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, c_.rate_hz};
        return 0;
      case VIDIOC_QUERYCTRL: {
        auto& q = *static_cast<v4l2_queryctrl*>(argument);
        if (q.id == V4L2_CID_GAIN && !c_.has_gain) return -EINVAL;
        q.minimum = 1;
        q.maximum = 500;
        q.flags = 0;
        return 0;
      }
      case VIDIOC_S_CTRL: {
        const auto& s = *static_cast<v4l2_control*>(argument);
        c_.controls[s.id] = s.value;
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& r = *static_cast<v4l2_requestbuffers*>(argument);
        c_.memory.assign(r.count, std::vector<std::uint8_t>(c_.row_bytes() * c_.height + 1024));
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& b = *static_cast<v4l2_buffer*>(argument);
        b.length = static_cast<std::uint32_t>(c_.memory.at(b.index).size());
        b.m.offset = b.index;
        return 0;
      }
      case VIDIOC_QBUF:
        c_.queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_STREAMON:
        if (c_.stream_error != 0) return -c_.stream_error;
        c_.streaming = true;
        return 0;
      case VIDIOC_STREAMOFF:
        c_.streaming = false;
        return 0;
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      default:
        return -ENOTTY;
    }
  }

 private:
  int dequeue(v4l2_buffer& b) {
    if (c_.dequeue_error != 0) return -c_.dequeue_error;
    if (c_.frames.empty() || c_.queued.empty()) return -EAGAIN;
    const FakeCamera::Frame frame = c_.frames.front();
    c_.frames.pop_front();
    b.index = c_.queued.front();
    c_.queued.pop_front();
    std::memcpy(c_.memory[b.index].data(), frame.bytes.data(), frame.bytes.size());
    b.bytesused = static_cast<std::uint32_t>(frame.bytes.size());
    b.timestamp = {frame.stamp_us / 1'000'000, frame.stamp_us % 1'000'000};
    b.sequence = frame.sequence;
    b.flags = frame.flags;
    return 0;
  }
  FakeCamera& c_;
};

}  // namespace crane::test
