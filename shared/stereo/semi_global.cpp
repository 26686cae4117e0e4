// SPDX-License-Identifier: Apache-2.0
#include "stereo/semi_global.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>
#include <vector>

#include "base/expects.hpp"
#include "base/threads.hpp"
#include "stereo/semi_global_sweep.hpp"
#include "stereo/subpixel.hpp"

namespace crane {
namespace {

/// The largest pixel cost (31) and jump add up to 63: four paths fit a byte.
constexpr int kP1 = 6, kJumpMax = 32, kJumpMin = 14;
/// Columns after which the rows below may follow.
constexpr int kPartColumns = 160;

struct Free {
  void operator()(void* p) const { std::free(p); }
};
using Bytes = std::unique_ptr<std::uint8_t, Free>;

/// Uninitialised bytes, aligned for any vector.
Bytes bytes(std::size_t size) {
  void* p = std::aligned_alloc(64, (size + 63) & ~std::size_t{63});
  if (p == nullptr) throw std::bad_alloc();
  return Bytes(static_cast<std::uint8_t*>(p));
}

/// Brightness less 128, in the order of the pixels or mirrored; eight at once.
void copy_signed(const std::uint8_t* from, int count, bool mirrored, std::int8_t* to) {
  constexpr std::uint64_t kSigns = 0x8080808080808080ULL;
  int x = 0;
  for (; x + 8 <= count; x += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, from + (mirrored ? count - 8 - x : x), 8);
    eight = (mirrored ? __builtin_bswap64(eight) : eight) ^ kSigns;
    std::memcpy(to + x, &eight, 8);
  }
  for (; x < count; ++x) to[x] = static_cast<std::int8_t>(from[mirrored ? count - 1 - x : x] - 128);
}

/// A jump where the brightness jumps costs less: depth edges lie there.
void jump_costs(const std::uint8_t* __restrict a, const std::uint8_t* __restrict b, int count,
                std::uint8_t* __restrict to) {
  for (int x = 0; x < count; ++x) {
    const auto apart = static_cast<std::uint8_t>(std::max(a[x], b[x]) - std::min(a[x], b[x]));
    to[x] =
        static_cast<std::uint8_t>(kJumpMax - std::min<std::uint8_t>(kJumpMax - kJumpMin, apart));
  }
}

}  // namespace

struct SemiGlobalMatcher::Impl {
  int width, height;
  SemiGlobalSettings settings;
  int disparities, rows;  ///< searched; matched
  std::array<std::vector<std::uint8_t>, kCensusPlanes> left, right;
  std::ptrdiff_t left_stride, right_stride;
  std::vector<std::uint8_t> p2_left, p2_above, margin;
  std::vector<std::int16_t> winners, settled;
  std::vector<std::uint8_t> settled_confidence;
  std::vector<float> refined, weight, brightness, limit;
  Bytes sums;
  /// Down, or up: pairs of rows in their order, each as far as the columns of the one before it.
  struct Direction {
    Bytes path;
    std::atomic<int> next{0};  ///< pair that nobody has begun
    std::unique_ptr<std::atomic<int>[]> parts_done;
  };
  std::array<Direction, 2> directions;
  struct Scratch {
    std::vector<std::uint8_t> right_best;
    Bytes carried;
    std::vector<std::int8_t> padded;
  };
  std::vector<Scratch> threads;

  /// Census of matched rows [from, to) of one image.
  void census(const GreyView& image, int from, int to, bool mirrored, Scratch& scratch) {
    if (from == to) return;
    const int step = settings.row_step;
    const int lines = (to - from - 1) * step + 1 + 2 * kCensusReachY;
    const std::ptrdiff_t stride = width + 2 * kCensusReachX + kSlack;
    scratch.padded.resize(static_cast<std::size_t>(lines * stride));
    for (int line = 0; line < lines; ++line) {
      const int y = std::clamp(from * step + line - kCensusReachY, 0, height - 1);
      const std::uint8_t* pixels = image.pixels + y * image.stride;
      std::int8_t* to_pixels = scratch.padded.data() + line * stride;
      copy_signed(pixels, width, mirrored, to_pixels + kCensusReachX);
      std::fill(to_pixels, to_pixels + kCensusReachX, to_pixels[kCensusReachX]);
      std::fill(to_pixels + kCensusReachX + width, to_pixels + stride,
                to_pixels[kCensusReachX + width - 1]);
    }
    const std::ptrdiff_t plane_stride = mirrored ? right_stride : left_stride;
    for (int row = from; row < to; ++row) {
      std::uint8_t* planes[kCensusPlanes];
      for (std::size_t p = 0; p < kCensusPlanes; ++p)
        planes[p] = (mirrored ? right : left)[p].data() + row * plane_stride;
      census_row(
          scratch.padded.data() + ((row - from) * step + kCensusReachY) * stride + kCensusReachX,
          stride, width, mirrored, planes);
      for (std::uint8_t* plane : planes)
        std::fill(plane + width, plane + plane_stride, plane[width - 1]);
    }
  }

  /// Of matched rows [from, to).
  void jumps(const GreyView& image, int from, int to) {
    for (int row = from; row < to; ++row) {
      const std::uint8_t* pixels = image.pixels + row * settings.row_step * image.stride;
      const std::uint8_t* above = row > 0 ? pixels - settings.row_step * image.stride : pixels;
      std::uint8_t* to_left = p2_left.data() + std::ptrdiff_t(row) * width;
      to_left[0] = kJumpMax;
      jump_costs(pixels + 1, pixels, width - 1, to_left + 1);
      jump_costs(pixels, above, width, p2_above.data() + std::ptrdiff_t(row) * width);
    }
  }

  /// Rows [0, rows / 2) down and the others up, or (`finish`) the ways on from there. `own`: the
  /// direction that the thread begins with; when it has no rows left, it helps with the other.
  void sweep_all(const SweepInput& in, bool finish, int own, Scratch& scratch,
                 const SweepOutput& out) {
    for (const int which : {own, 1 - own}) {
      Direction& d = directions[static_cast<std::size_t>(which)];
      const bool down = which == 0;
      const int middle = rows / 2;
      const int first = down ? (finish ? middle : 0) : (finish ? middle - 1 : rows - 1);
      const int count = down != finish ? middle : rows - middle;
      SweepState state{d.path.get(), scratch.right_best.data(), scratch.carried.get()};
      SweepPart part;
      part.direction = down ? 1 : -1;
      part.finish = finish;
      const int columns = width - in.first;
      for (int pair = d.next++; 2 * pair < count; pair = d.next++) {
        part.y = first + 2 * pair * part.direction;
        part.rows = std::min(2, count - 2 * pair);
        int done = 0;
        for (part.begin = 0; part.begin < columns; part.begin = part.end) {
          part.end = std::min(part.begin + kPartColumns, columns);
          ++done;
          if (pair > 0) {
            std::atomic<int>& before = d.parts_done[pair - 1];
            for (int n = before.load(); n < done; n = before.load()) before.wait(n);
          }
          sweep(in, state, part, out);
          d.parts_done[pair].store(done);
          d.parts_done[pair].notify_all();
        }
      }
    }
  }
  /// From one thread, between two rounds of sweep_all().
  void rewind() {
    for (Direction& d : directions) {
      d.next = 0;
      for (int pair = 0; pair <= rows / 4 + 1; ++pair) d.parts_done[pair] = 0;
    }
  }

  /// Matched rows [from, to) to the rows of the image; a row between two of them is their mean
  /// where they show the same surface. Returns the pixels with a match.
  std::uint32_t spread(int from, int to, std::span<std::int16_t> disparity,
                       std::span<std::uint8_t> confidence) const {
    std::uint32_t matched = 0;
    const int step = settings.row_step;
    for (int row = from; row < to; ++row) {
      const std::ptrdiff_t at = std::ptrdiff_t(row) * width;
      const std::int16_t* own = settled.data() + at;
      const std::int16_t* next = row + 1 < rows ? own + width : own;
      const std::uint8_t* trust = settled_confidence.data() + at;
      std::int16_t* to_disparity = disparity.data() + step * at;
      std::uint8_t* to_confidence = confidence.data() + step * at;
      std::copy(own, own + width, to_disparity);
      std::copy(trust, trust + width, to_confidence);
      for (int x = 0; x < width; ++x) matched += own[x] > 0 ? 1 : 0;
      if (step == 1 || row * step + 1 >= height) continue;
      for (int x = 0; x < width; ++x) {
        const bool same =
            own[x] > 0 && next[x] > 0 && std::abs(own[x] - next[x]) <= kDisparityScale;
        to_disparity[width + x] =
            same ? static_cast<std::int16_t>((own[x] + next[x]) / 2) : std::int16_t{0};
        to_confidence[width + x] = same ? trust[x] : std::uint8_t{0};
        matched += same ? 1 : 0;
      }
    }
    return matched;
  }
};

int SemiGlobalMatcher::disparities(int wanted) {
  for (int n : {32, 64, 96, 128, 192})
    if (n >= wanted) return n;
  return kMaxDisparities;
}

SemiGlobalMatcher::SemiGlobalMatcher(int width, int height, const SemiGlobalSettings& settings)
    : impl_(std::make_unique<Impl>()) {
  expects(settings.first_px >= 0 && settings.count_px <= kMaxDisparities, "search range");
  expects(settings.row_step == 1 || settings.row_step == 2, "row step is 1 or 2");
  expects(width >= kMinWidth && height >= kMinHeight && width > settings.first_px + 8,
          "the image holds the search");
  Impl& m = *impl_;
  m.width = width;
  m.height = height;
  m.settings = settings;
  m.disparities = disparities(settings.count_px);
  m.rows = (height + settings.row_step - 1) / settings.row_step;
  m.left_stride = width + kSlack;
  m.right_stride = width + settings.first_px + m.disparities + kSlack;
  for (auto& plane : m.left) plane.resize(std::size_t(m.rows * m.left_stride));
  for (auto& plane : m.right) plane.resize(std::size_t(m.rows * m.right_stride));
  const std::size_t pixels = std::size_t(width) * m.rows;
  m.sums = bytes(pixels * m.disparities);
  for (Impl::Direction& d : m.directions) {
    d.path = bytes(std::size_t(width) * m.disparities);
    d.parts_done = std::make_unique<std::atomic<int>[]>(std::size_t(m.rows) / 4 + 2);
  }
  m.threads.resize(std::size_t(threads_or_default(settings.threads)));
  for (Impl::Scratch& t : m.threads) {
    t.right_best.resize(2 * std::size_t(width + settings.first_px + m.disparities + 2 * kSlack));
    t.carried = bytes(6 * std::size_t(m.disparities));
  }
  m.winners.resize(pixels);
  m.settled.resize(pixels);
  m.settled_confidence.resize(pixels);
  m.refined.resize(pixels);
  m.weight.resize(pixels);
  m.brightness.resize(pixels);
  m.limit.resize(pixels);
  m.margin.resize(pixels);
  m.p2_left.resize(pixels + 1);
  m.p2_above.resize(pixels);
}

SemiGlobalMatcher::~SemiGlobalMatcher() = default;
SemiGlobalMatcher::SemiGlobalMatcher(SemiGlobalMatcher&&) noexcept = default;

SemiGlobalReport SemiGlobalMatcher::match(const GreyView& left, const GreyView& right,
                                          std::span<std::int16_t> disparity,
                                          std::span<std::uint8_t> confidence) {
  Impl& m = *impl_;
  const std::size_t pixels = std::size_t(m.width) * m.height;
  expects(left.width == m.width && left.height == m.height && right.width == m.width &&
              right.height == m.height,
          "images have the matcher's size");
  expects(disparity.size() == pixels && confidence.size() == pixels,
          "outputs have the matcher's size");
  SweepInput in;
  in.width = m.width;
  in.height = m.rows;
  in.first = m.settings.first_px;
  in.disparities = m.disparities;
  for (std::size_t p = 0; p < kCensusPlanes; ++p) {
    in.left[p] = m.left[p].data();
    in.right[p] = m.right[p].data();
  }
  in.left_stride = m.left_stride;
  in.right_stride = m.right_stride;
  in.p1 = kP1;
  in.p2_left = m.p2_left.data();
  in.p2_above = m.p2_above.data();
  in.sums = m.sums.get();

  const Subpixel subpixel{m.refined.data(), m.weight.data(), m.brightness.data(), m.limit.data()};
  const auto threads = static_cast<int>(m.threads.size());
  std::vector<SemiGlobalReport> reports(m.threads.size());
  for (Impl::Direction& d : m.directions)
    std::memset(d.path.get(), 0, std::size_t(m.width) * m.disparities);
  m.rewind();
  on_threads(threads, [&](int thread, Meeting& meeting) {
    Impl::Scratch& scratch = m.threads[std::size_t(thread)];
    SemiGlobalReport& report = reports[std::size_t(thread)];
    const auto [from, to] = share_of(m.rows, thread, threads);
    m.census(left, from, to, false, scratch);
    m.census(right, from, to, true, scratch);
    m.jumps(left, from, to);
    const SweepOutput out{m.winners.data(), m.margin.data(), m.settings.left_right_px,
                          m.settings.uniqueness, &report.at_near_end};
    meeting.meet();  // all have their census
    m.sweep_all(in, false, thread % 2, scratch, out);
    meeting.meet();  // all sums of one direction are there
    if (thread == 0) m.rewind();
    meeting.meet();
    m.sweep_all(in, true, thread % 2, scratch, out);
    meeting.meet();  // all winners
    const int step = m.settings.row_step;
    refine_subpixel({left.pixels, right.pixels, left.stride * step, right.stride * step,
                     m.winners.data(), m.width, m.rows},
                    from, to, subpixel);
    meeting.meet();  // all refined rows
    settle_subpixel(subpixel, m.width, m.rows, from, to, m.settled.data(),
                    m.settled_confidence.data());
    meeting.meet();  // the first settled row of the next thread
    report.matched = m.spread(from, to, disparity, confidence);
  });
  SemiGlobalReport sum;
  for (const SemiGlobalReport& r : reports) {
    sum.matched += r.matched;
    sum.at_near_end += r.at_near_end;
  }
  return sum;
}

}  // namespace crane
