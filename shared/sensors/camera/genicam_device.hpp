#pragma once

#include <chrono>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>

#include "sensors/camera/device_clock.hpp"
#include "sensors/camera/genicam_io.hpp"
#include "sensors/camera/raw_picture.hpp"
#include "sensors/camera/stereo_device.hpp"

namespace crane {

struct GenicamOptions {
  enum class Stamps {
    kCamera,   ///< of the picture's leader, by the camera's clock
    kChunk,    ///< ChunkTimestamp, for cameras whose leader says something else
    kArrival,  ///< when it arrived: late by readout and network
  };
  std::string camera;   ///< address or id
  bool single = false;  ///< one of two cameras; else left | right in one picture
  std::uint32_t width = 1280, height = 720;  ///< of each image [px]
  std::string pixel_format = "Mono8";
  double rate_hz = 15;
  /// "off": as its own clock says; "software": told by us, at multiples of 1/rate_hz of this host's
  /// clock, so that two cameras are told at once; else the line that triggers, "Line0".
  std::string trigger = "off";
  Stamps stamps = Stamps::kCamera;
  bool ptp = false;
  std::optional<double> exposure_us;
  std::optional<double> gain;
  bool swap = false;
  std::int64_t latency = 0;  ///< subtracted from every time [ns]
};

/// A GigE Vision or USB3 Vision camera, by whatever transport `io` has. Newest picture wins.
///
/// What is set is read again: cameras round and cut. Its stamps become epoch by DeviceClock; with
/// PTP in step they are epoch, taken as they are (TAI or UTC). Pictures that miss packets, of
/// another size or format are counted and refused.
class GenicamDevice final : public StereoDevice {
 public:
  GenicamDevice(GenicamOptions options, std::unique_ptr<GenicamIo> io,
                std::function<ClockPair()> clocks);
  ~GenicamDevice() override;

  Result<void> open() override;
  void close() override;
  Result<bool> grab(const FrameBuffers& out, FrameFacts& facts, FrameSource::Deadline deadline,
                    DropCounts& dropped) override;
  [[nodiscard]] std::uint64_t missed() const override { return missed_; }
  [[nodiscard]] std::string remark() const override { return remark_; }
  [[nodiscard]] std::string about() const override;

 private:
  using Names = std::initializer_list<const char*>;
  Result<void> set_mode();
  Result<void> set_trigger();
  Result<void> set_light();
  Result<void> set_clock();
  const char* first_of(Names names);
  Result<void> set_number(Names names, double value, const char* key, double tolerance);
  Result<void> set_text(const char* feature, const std::string& value, const char* key);
  Error trouble(const Error& error, const char* key) const;

  std::optional<GenicamPicture> newest(FrameSource::Deadline deadline, DropCounts& dropped,
                                       Result<void>& triggered);
  bool use(const GenicamPicture& picture, const FrameBuffers& out, FrameFacts& facts,
           DropCounts& dropped);
  TimeNs time_of(const GenicamPicture& picture, FrameFacts& facts, DropCounts& dropped);
  void look_at_ptp();
  void count(std::uint64_t number);

  GenicamOptions options_;
  std::unique_ptr<GenicamIo> io_;
  std::function<ClockPair()> clocks_;
  bool open_ = false;
  double ticks_per_second_ = 1e9;  ///< of ChunkTimestamp
  std::optional<std::chrono::steady_clock::time_point> next_trigger_;
  DeviceClock clock_;
  TimeNs ahead_ = 0;                  ///< of the epoch before the camera's clock [ns]
  const char* ptp_status_ = nullptr;  ///< the feature's name
  std::string ptp_;                   ///< what it said last
  bool by_ptp_ = false, by_arrival_ = false;
  std::uint64_t seen_ = 0;  ///< pictures since it opened
  std::optional<std::uint64_t> last_number_;
  std::uint64_t unwrapped_ = 0, missed_ = 0;
  bool given_ = false;  ///< the last picture that was grabbed
  std::string remark_;
};

}  // namespace crane
