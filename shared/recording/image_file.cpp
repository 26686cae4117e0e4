// SPDX-License-Identifier: Apache-2.0
#include "recording/image_file.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/read_file.hpp"
#include "imaging/jpeg.hpp"

namespace crane {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;

std::uint64_t be32(const std::vector<std::uint8_t>& f, std::size_t i) {
  return std::uint64_t{f[i]} << 24U | std::uint64_t{f[i + 1]} << 16U |
         std::uint64_t{f[i + 2]} << 8U | f[i + 3];
}

bool is_png(const std::vector<std::uint8_t>& f) {
  static constexpr std::uint8_t kSignature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  return f.size() > 33 && std::equal(std::begin(kSignature), std::end(kSignature), f.begin());
}

/// Bytes of a PNG up to the end of its last chunk, which some writers put something behind; 0: it
/// is cut.
std::size_t png_size(const std::vector<std::uint8_t>& f) {
  for (std::uint64_t at = 8; at + 12 <= f.size();) {
    const std::uint64_t end = at + 12 + be32(f, at);
    if (end > f.size()) return 0;
    const std::string type(f.begin() + std::ptrdiff_t(at + 4), f.begin() + std::ptrdiff_t(at + 8));
    if (type == "IEND") return end;
    at = end;
  }
  return 0;
}

/// 16-bit values to 8 bits; those of a camera of fewer bits fill only the lower ones.
Result<cv::Mat> to_8_bits(const cv::Mat& image, const std::string& name, int bits) {
  double most = 0;
  cv::minMaxLoc(image.reshape(1), nullptr, &most);
  const std::string largest = "its largest value is " + std::to_string(static_cast<int>(most));
  if (bits == 0)
    return Error{
        ErrorCode::kConfiguration, name,
        "has 16 bits, and its sensor.yaml does not say how many of them count (" + largest + ")",
        "write 'bits: 12' for values up to 4095, 'bits: 16' for values that fill 16 bits "
        "(left-aligned ones too), or convert it to 8 bits"};
  if (most >= double(1U << static_cast<unsigned>(bits)))
    return Error{ErrorCode::kConfiguration, name,
                 largest + ", sensor.yaml says bits: " + std::to_string(bits),
                 "correct 'bits'; left-aligned values have 16"};
  cv::Mat out;
  out.create(image.size(), CV_8UC(image.channels()));
  const auto* from = image.ptr<std::uint16_t>();
  auto* to = out.ptr<std::uint8_t>();
  const std::size_t count = image.total() * static_cast<std::size_t>(image.channels());
  for (std::size_t i = 0; i < count; ++i) to[i] = static_cast<std::uint8_t>(from[i] >> (bits - 8));
  return out;
}

Result<Image> decode_png(std::vector<std::uint8_t> file, const std::string& name,
                         std::uint64_t max_pixels, int bits) {
  const std::size_t size = png_size(file);
  if (size == 0)
    return Error{ErrorCode::kBadData, name, "is not a complete PNG file (truncated?)",
                 "record it again or remove its line from data.csv"};
  file.resize(size);
  // Width and height from the header, before any memory is taken for the pixels.
  if (be32(file, 16) == 0 || be32(file, 20) == 0 || be32(file, 16) * be32(file, 20) > max_pixels)
    return too_many_pixels(name, be32(file, 16), be32(file, 20), max_pixels);
  cv::Mat image;
  try {  // An orientation in it (eXIf) is left alone: a calibration is of the pixels as stored.
    image = cv::imdecode(file,
                         cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, name, "cannot be decoded: " + e.err, "record it again"};
  }
  if (image.empty() || (image.channels() != 1 && image.channels() != 3) ||
      (image.depth() != CV_8U && image.depth() != CV_16U))
    return Error{ErrorCode::kBadData, name, "is damaged, or not a grey or colour image",
                 "record it again, as 8-bit PNG or JPEG"};
  if (image.depth() == CV_16U) {
    auto scaled = to_8_bits(image, name, bits);
    if (!scaled) return scaled.error();
    image = *scaled;
  }
  Image out;
  out.width = static_cast<std::uint32_t>(image.cols);
  out.height = static_cast<std::uint32_t>(image.rows);
  out.channels = static_cast<std::uint32_t>(image.channels());
  out.bytes.assign(image.datastart, image.dataend);
  return out;
}

}  // namespace

Result<Image> decode_image(const std::vector<std::uint8_t>& file, const std::string& name,
                           std::uint64_t max_pixels, int bits) {
  if (is_jpeg(file)) return decode_jpeg(file, name, max_pixels);
  if (is_png(file)) return decode_png(file, name, max_pixels, bits);
  return Error{ErrorCode::kBadData, name, "is not a complete PNG or JPEG file (truncated?)",
               "record it again or remove its line from data.csv"};
}

Result<Image> read_image(const std::string& path, std::uint64_t max_pixels, int bits) {
  const auto file = read_file(path, kMaxFileBytes);
  if (file)
    return decode_image(std::vector<std::uint8_t>(file->begin(), file->end()), path, max_pixels,
                        bits);
  if (file.error().code == ErrorCode::kNotAvailable)
    return Error{ErrorCode::kBadData, path, "no such image file",
                 "data.csv names files in the folder data beside it"};
  return file.error();
}

Result<std::vector<std::uint8_t>> encode_image(const Image& image, const std::string& format,
                                               int jpeg_quality) {
  expects(image.bytes.size() == std::size_t(image.width) * image.height * image.channels,
          "bytes fit the image size");
  const cv::Mat mat(static_cast<int>(image.height), static_cast<int>(image.width),
                    image.channels == 3 ? CV_8UC3 : CV_8UC1,
                    const_cast<std::uint8_t*>(image.bytes.data()));
  std::vector<std::uint8_t> bytes;
  try {
    if (cv::imencode("." + format, mat, bytes,
                     {cv::IMWRITE_JPEG_QUALITY, jpeg_quality, cv::IMWRITE_PNG_COMPRESSION, 1}))
      return bytes;
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kResource, format, e.err, ""};
  }
  return Error{ErrorCode::kResource, format, "cannot be encoded", ""};
}

Result<std::vector<std::uint8_t>> encode_deep(const DeepImage& image) {
  expects(image.values.size() == std::size_t(image.width) * image.height,
          "values fit the image size");
  const cv::Mat mat(static_cast<int>(image.height), static_cast<int>(image.width), CV_16UC1,
                    const_cast<std::uint16_t*>(image.values.data()));
  std::vector<std::uint8_t> bytes;
  try {
    if (cv::imencode(".png", mat, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1})) return bytes;
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kResource, "png", e.err, ""};
  }
  return Error{ErrorCode::kResource, "png", "cannot be encoded", ""};
}

Result<void> write_image(const std::string& path, const Image& image) {
  expects(image.bytes.size() == std::size_t(image.width) * image.height * image.channels,
          "bytes fit the image size");
  const cv::Mat mat(static_cast<int>(image.height), static_cast<int>(image.width),
                    image.channels == 3 ? CV_8UC3 : CV_8UC1,
                    const_cast<std::uint8_t*>(image.bytes.data()));
  bool written = false;
  try {
    written =
        cv::imwrite(path, mat, {cv::IMWRITE_JPEG_QUALITY, 95, cv::IMWRITE_PNG_COMPRESSION, 1});
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written)
    return Error{ErrorCode::kResource, path, "cannot be written",
                 "check permissions and free space"};
  return {};
}

}  // namespace crane
