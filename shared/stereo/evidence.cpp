// SPDX-License-Identifier: Apache-2.0
#include "stereo/evidence.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "base/expects.hpp"
#include "stereo/evidence_rows.hpp"

namespace crane {
namespace {

/// Limits of what is believed to be noise [grey levels^2]: at least this share of the image's
/// variance (compression leaves as much), and between these.
constexpr float kNoiseShare = 0.01F, kNoiseMin = 0.5F, kNoiseUsual = 3, kNoiseMax = 25;
constexpr std::size_t kEnough = 50;  ///< residuals to know the noise from
/// Two rows whose brightness along the row differs by as much are not joined [grey levels].
constexpr std::uint8_t kEdge = 6;
/// Longest gap between matches that is filled [px].
constexpr int kGap = 6;
/// Longest stretch without texture that its ends vouch for [px].
constexpr int kStretch = 64;
constexpr std::uint8_t kJoinsAbove = 16, kJoinsBelow = 32, kJoinsAlong = 64, kMatched = 128;
/// Longest run of unproven matches in a single row that is noise [px].
constexpr int kSpeck = 8;

EvidenceRow row_of(const GreyView& left, const GreyView& right, const std::int16_t* disparity,
                   int y) {
  return {left.pixels + y * left.stride, right.pixels + y * right.stride,
          disparity + std::ptrdiff_t(y) * left.width, left.width};
}

/// Pixels of a row that are passed over at once where nothing is to be done; `same` for each of a
/// word's bytes.
constexpr int kWord = 8;
constexpr std::uint64_t same(std::uint8_t byte) {
  return 0x0101010101010101ULL * byte;
}
std::uint64_t word_at(const std::uint8_t* bytes) {
  std::uint64_t word = 0;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

bool all_matched(const std::int16_t* disparity) {
  bool all = true;
  for (int i = 0; i < kWord; ++i) all &= disparity[i] > 0;
  return all;
}

/// Short gaps along a row between matches of one surface take its disparity: whether it is theirs
/// is asked after that.
void fill_gaps(std::int16_t* disparity, std::uint8_t* confidence, int width) {
  int last = -1;  // match before the gap
  for (int x = 0; x < width; ++x) {
    while (last + 1 == x && x + kWord <= width && all_matched(disparity + x)) {
      x += kWord;
      last = x - 1;
    }
    if (x >= width || disparity[x] <= 0) continue;
    const int gap = x - last - 1;
    if (last >= 0 && gap > 0 && gap <= kGap &&
        std::abs(disparity[x] - disparity[last]) <= kDisparityScale)
      for (int i = last + 1; i < x; ++i) {
        disparity[i] = static_cast<std::int16_t>(
            disparity[last] + (disparity[x] - disparity[last]) * (i - last) / (x - last));
        confidence[i] = std::min(confidence[last], confidence[x]);
      }
    last = x;
  }
}

/// A short stretch without texture between two pixels that have plenty, both explained, on one
/// surface: a blot on the floor, whose ends are matched. (The ends of a rod that stands above the
/// floor are not, at the floor's disparity.)
void join_along(const std::int16_t* disparity, std::uint8_t* bits, int width) {
  constexpr std::uint8_t kEnd = kRowDistinct | kRowExplained;
  int last = -1;  // pixel with texture before the stretch
  for (int x = 0; x < width; x += 2) {
    while (x + kWord <= width && last + 2 >= x &&
           (word_at(bits + x) & same(kRowTextured)) == same(kRowTextured)) {
      x += kWord;
      last = x - 2;
    }
    if (x >= width || (bits[x] & kRowTextured) == 0) continue;
    const int length = x - last;
    if (last >= 0 && length > 2 && length <= kStretch && (bits[x] & kEnd) == kEnd &&
        (bits[last] & kEnd) == kEnd && disparity[x] > 0 && disparity[last] > 0 &&
        std::abs(disparity[x] - disparity[last]) <= kDisparityScale)
      for (int i = last + 2; i < x; ++i) bits[i] |= kJoinsAlong;
    last = x;
  }
}

void mark_matched(const std::int16_t* __restrict disparity, std::uint8_t* __restrict bits,
                  int width) {
  for (int x = 0; x < width; ++x)
    bits[x] = static_cast<std::uint8_t>(bits[x] | (disparity[x] > 0 ? kMatched : 0));
}

std::uint8_t apart(std::uint8_t a, std::uint8_t b) {
  return static_cast<std::uint8_t>(std::max(a, b) - std::min(a, b));
}

/// A pixel is joined if it has texture, or if the one before is and no edge lies between. `means`
/// of the row itself, the one before and the one before that.
void join_row(const std::uint8_t* const means[3], const std::uint8_t* __restrict before,
              std::uint8_t* __restrict bits, std::uint8_t mark, int count) {
  const std::uint8_t* __restrict own = means[0];
  const std::uint8_t* __restrict one = means[1];
  const std::uint8_t* __restrict two = means[2];
  for (int x = 0; x < count; ++x) {
    const std::uint8_t most = std::max(apart(own[x], one[x]), apart(own[x], two[x]));
    const auto joins = static_cast<std::uint8_t>(most < kEdge ? 0xFF : 0);
    const auto textured =
        static_cast<std::uint8_t>((bits[x] & (kRowTextured | kJoinsAlong)) != 0 ? 0xFF : 0);
    bits[x] = static_cast<std::uint8_t>(bits[x] | (((joins & before[x]) | textured) & mark));
  }
}

/// Columns [from, to), row after row downwards (step 1) or upwards (-1).
void join(const std::uint8_t* mean, std::uint8_t* bits, int width, int height, int step,
          std::uint8_t mark, int from, int to) {
  const std::vector<std::uint8_t> none(static_cast<std::size_t>(width));
  for (int i = 0; i < height; ++i) {
    const std::ptrdiff_t at = std::ptrdiff_t(step > 0 ? i : height - 1 - i) * width + from;
    const std::ptrdiff_t one = at - (i > 0 ? step * width : 0);
    const std::ptrdiff_t two = one - (i > 1 ? step * width : 0);
    const std::uint8_t* const means[3] = {mean + at, mean + one, mean + two};
    join_row(means, i > 0 ? bits + one : none.data(), bits + at, mark, to - from);
  }
}

/// What becomes of a match with these bits.
struct Verdicts {
  enum : std::int8_t { kProven = 0, kWeak = 1, kUnexplained = 2, kBorrowed = 3 };
  std::int8_t of[256] = {};
  constexpr Verdicts() {
    for (int bits = 0; bits < 256; ++bits) {
      const bool joined = (bits & (kJoinsAbove | kJoinsBelow | kJoinsAlong)) != 0;
      of[bits] = !joined                       ? kBorrowed
                 : (bits & kRowExplained) != 0 ? kProven
                 : (bits & kRowLikely) != 0    ? kWeak
                                               : kUnexplained;
    }
  }
};
constexpr Verdicts kVerdicts;

/// Whether a match with these bits is taken back altogether.
bool is_dropped(std::uint8_t bits) {
  return kVerdicts.of[bits] >= Verdicts::kUnexplained;
}

/// Whether all of a word's pixels are proven or have no match.
bool all_as_they_are(std::uint64_t bits) {
  const std::uint64_t joined = bits / kJoinsAbove | bits / kJoinsBelow | bits / kJoinsAlong;
  const std::uint64_t proven = joined & (bits / kRowExplained);
  return ((proven | ~(bits / kMatched)) & same(1)) == same(1);
}

/// End of the run of matches from x on that are taken back.
int end_of_run(const std::uint8_t* bits, const std::int16_t* disparity, int x, int width) {
  while (x < width && disparity[x] > 0 && is_dropped(bits[x])) ++x;
  return x;
}

/// Whether all of columns [from, to) of a row have a match that stays, proven or likely.
bool all_stay(const std::uint8_t* bits, int from, int to) {
  for (int x = from; x < to; ++x)
    if ((bits[x] & kMatched) == 0 || is_dropped(bits[x])) return false;
  return true;
}

/// Rows [from, to). A few pixels of a single row, with the rows above and below in order, are noise
/// and not a thing: likely.
EvidenceReport apply(const std::uint8_t* bits, int width, int height, int from, int to,
                     std::int16_t* disparity, std::uint8_t* confidence) {
  std::uint32_t count[4] = {};
  for (int y = from; y < to; ++y) {
    const std::uint8_t* row = bits + std::ptrdiff_t(y) * width;
    std::int16_t* d = disparity + std::ptrdiff_t(y) * width;
    std::uint8_t* c = confidence + std::ptrdiff_t(y) * width;
    for (int x = 0; x < width; ++x) {
      while (x + kWord <= width && all_as_they_are(word_at(row + x))) x += kWord;
      if (x >= width || d[x] <= 0) continue;
      const auto verdict = kVerdicts.of[row[x]];
      if (verdict == Verdicts::kProven) continue;
      if (verdict == Verdicts::kWeak) {
        d[x] = static_cast<std::int16_t>(-d[x]);
        ++count[Verdicts::kWeak];
        continue;
      }
      const int end = end_of_run(row, d, x, width);
      const bool noise = end - x <= kSpeck && (y == 0 || all_stay(row - width, x, end)) &&
                         (y + 1 == height || all_stay(row + width, x, end));
      for (; x < end; ++x) {
        ++count[noise ? static_cast<int>(Verdicts::kWeak) : kVerdicts.of[row[x]]];
        d[x] = noise ? static_cast<std::int16_t>(-d[x]) : std::int16_t{0};
        if (!noise) c[x] = 0;
      }
      --x;
    }
  }
  return {count[Verdicts::kUnexplained], count[Verdicts::kBorrowed], count[Verdicts::kWeak]};
}

/// Of the brightness of every eighth pixel of every eighth row.
float variance_of(const GreyView& image) {
  double sum = 0, squares = 0;
  int count = 0;
  for (int y = 0; y < image.height; y += 8)
    for (int x = 0; x < image.width; x += 8, ++count) {
      const double p = image.pixels[y * image.stride + x];
      sum += p;
      squares += p * p;
    }
  return static_cast<float>((squares - sum * sum / count) / count);
}

}  // namespace

float Evidence::noise_of(const GreyView& left, const GreyView& right,
                         std::span<const std::int16_t> disparity) {
  constexpr int kRows = 24, kColumns = 32;  // apart
  residuals_.clear();
  for (int y = kRows / 2; y < left.height; y += kRows)
    for (int x = kColumns; x + kColumns < left.width; x += kColumns)
      if (const float r = row_residual(row_of(left, right, disparity.data(), y), x); r >= 0)
        residuals_.push_back(r);
  const float least = std::clamp(kNoiseShare * variance_of(left), kNoiseMin, kNoiseUsual);
  if (residuals_.size() < kEnough) return least;
  const auto middle = residuals_.begin() + static_cast<std::ptrdiff_t>(residuals_.size() / 2);
  std::nth_element(residuals_.begin(), middle, residuals_.end());
  return std::clamp(*middle / 2, least, kNoiseMax);
}

EvidenceReport Evidence::keep_proven(const GreyView& left, const GreyView& right,
                                     std::span<std::int16_t> disparity,
                                     std::span<std::uint8_t> confidence) {
  const int width = left.width;
  const int height = left.height;
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  expects(disparity.size() == pixels && confidence.size() == pixels, "outputs fit the images");
  mean_.resize(pixels);
  bits_.resize(pixels);
  EvidenceLimits limits;
  limits.noise = noise_of(left, right, disparity);
  EvidenceReport sum;
  std::mutex adding;
  on_threads(threads_, [&](int thread, Meeting& meeting) {
    const auto [y0, y1] = share_of(height, thread, threads_);
    const auto [x0, x1] = share_of(width, thread, threads_);
    std::vector<std::int32_t> sums(evidence_sums(width));
    std::vector<std::uint8_t> bytes(evidence_bytes(width));
    EvidenceScratch scratch{sums.data(), bytes.data()};
    for (int y = y0; y < y1; ++y) {
      const std::ptrdiff_t at = std::ptrdiff_t(y) * width;
      fill_gaps(disparity.data() + at, confidence.data() + at, width);
      look_along_row(row_of(left, right, disparity.data(), y), limits, scratch, mean_.data() + at,
                     bits_.data() + at);
      join_along(disparity.data() + at, bits_.data() + at, width);
      mark_matched(disparity.data() + at, bits_.data() + at, width);
    }
    meeting.meet();  // the other rows
    join(mean_.data(), bits_.data(), width, height, 1, kJoinsAbove, x0, x1);
    join(mean_.data(), bits_.data(), width, height, -1, kJoinsBelow, x0, x1);
    meeting.meet();  // the other columns
    const EvidenceReport own =
        apply(bits_.data(), width, height, y0, y1, disparity.data(), confidence.data());
    const std::lock_guard lock(adding);
    sum.unexplained += own.unexplained;
    sum.borrowed += own.borrowed;
    sum.weak += own.weak;
  });
  return sum;
}

}  // namespace crane
