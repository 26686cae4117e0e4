// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/usb/video.h>
#include <linux/uvcvideo.h>
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
  std::string card = "UVC Camera";
  std::uint16_t unit_bytes =
      0;                        ///< of the ZED's extension unit: 64 on USB 2, 384 on USB 3; 0: none
  bool deaf_right_eye = false;  ///< its right sensor takes nothing
  int unit_fails = 0;           ///< so many of its next commands fail
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
  /// The ZED's registers: of the left and right sensor (0xA3, 0xA5) and the processor (0xA2).
  std::map<std::pair<std::uint8_t, std::uint32_t>, std::uint8_t> registers = {
      {{0xA2, 0x80181033}, 0xFF}, {{0xA2, 0x80181833}, 0xFF}};
  std::vector<std::uint8_t> unit_answer;
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
        std::strncpy(reinterpret_cast<char*>(a.card), c_.card.c_str(), sizeof a.card);
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
      case UVCIOC_CTRL_QUERY:
        return unit(*static_cast<uvc_xu_control_query*>(argument));
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      default:
        return -ENOTTY;
    }
  }

 private:
  /// As the ZED answers: a command in, its answer with the next question.
  int unit(uvc_xu_control_query& q) {
    if (c_.unit_bytes == 0 || q.unit != 4 || q.selector != 2) return -ENOENT;
    if (q.query == UVC_GET_LEN) {
      if (q.size != 2) return -ENOBUFS;
      q.data[0] = static_cast<std::uint8_t>(c_.unit_bytes);
      q.data[1] = static_cast<std::uint8_t>(c_.unit_bytes >> 8U);
      return 0;
    }
    if (q.size != c_.unit_bytes) return -ENOBUFS;
    if (c_.unit_fails > 0) return --c_.unit_fails, -EPIPE;
    if (q.query == UVC_GET_CUR) {
      if (c_.unit_answer.size() != q.size) return -EINVAL;
      std::memcpy(q.data, c_.unit_answer.data(), q.size);
      return 0;
    }
    const std::uint8_t* b = q.data;
    const bool system = b[1] == 0xA2;
    if ((!system && b[1] != 0xA3 && b[1] != 0xA5) || b[2] != (system ? 0 : 0x6C) ||
        b[3] != (system ? 4 : 2) || b[4] != 1 || b[9] != (system ? 0 : 0x90) || b[10] != 1)
      return -EINVAL;
    const std::pair<std::uint8_t, std::uint32_t> at = {b[1], std::uint32_t{b[5]} << 24U |
                                                                 std::uint32_t{b[6]} << 16U |
                                                                 std::uint32_t{b[7]} << 8U | b[8]};
    if (b[0] == 0x50 && !(c_.deaf_right_eye && b[1] == 0xA5)) c_.registers[at] = b[16];
    c_.unit_answer.assign(b, b + q.size);
    c_.unit_answer[17] = c_.registers[at];
    return 0;
  }
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
