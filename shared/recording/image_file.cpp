#include "recording/image_file.hpp"

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace crane {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;

/// OpenCV decodes a cut JPEG into grey rows with only a warning: look for the end of the stream.
bool is_whole(const std::vector<std::uint8_t>& f) {
  const bool jpeg = f.size() > 4 && f[0] == 0xFF && f[1] == 0xD8;
  const bool png = f.size() > 16 && f[0] == 0x89 && f[1] == 'P';
  if (jpeg) {
    std::size_t end = f.size();
    while (end > 2 && f[end - 1] == 0) --end;  // some cameras pad with zeros
    return f[end - 2] == 0xFF && f[end - 1] == 0xD9;
  }
  if (png) {
    const std::string tail(f.end() - 12, f.end());
    return tail.find("IEND") != std::string::npos;
  }
  return false;
}

/// Width and height from the header, before any memory is taken for the pixels.
bool header_size(const std::vector<std::uint8_t>& f, std::uint64_t& width, std::uint64_t& height) {
  const auto be16 = [&f](std::size_t i) { return std::uint64_t(f[i]) << 8U | f[i + 1]; };
  if (f[0] == 0x89) {
    if (f.size() < 24) return false;
    width = be16(16) << 16U | be16(18);
    height = be16(20) << 16U | be16(22);
    return true;
  }
  for (std::size_t i = 2; i + 9 < f.size();) {
    if (f[i] != 0xFF) return false;
    const std::uint8_t marker = f[i + 1];
    if (marker == 0xFF) {
      ++i;
      continue;
    }
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
      height = be16(i + 5);
      width = be16(i + 7);
      return true;
    }
    i += 2 + be16(i + 2);
  }
  return false;
}

}  // namespace

Result<Image> decode_image(const std::vector<std::uint8_t>& file, const std::string& name,
                           std::uint64_t max_pixels) {
  if (!is_whole(file))
    return Error{ErrorCode::kBadData, name, "is not a complete PNG or JPEG file (truncated?)",
                 "record it again or remove its line from data.csv"};
  std::uint64_t width = 0;
  std::uint64_t height = 0;
  if (!header_size(file, width, height))
    return Error{ErrorCode::kBadData, name, "has a damaged header", "record it again"};
  if (width == 0 || height == 0 || width * height > max_pixels)
    return Error{ErrorCode::kBadData, name,
                 std::to_string(width) + " x " + std::to_string(height) + " pixels; at most " +
                     std::to_string(max_pixels) + " pixels fit a stereo frame",
                 "set the camera to 1280 x 720 or less"};
  cv::Mat image;
  try {
    image = cv::imdecode(file, cv::IMREAD_ANYCOLOR);
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, name, "cannot be decoded: " + e.err, "record it again"};
  }
  if (image.empty() || image.depth() != CV_8U || (image.channels() != 1 && image.channels() != 3))
    return Error{ErrorCode::kBadData, name, "is not an 8-bit grey or colour image",
                 "convert it to 8-bit PNG or JPEG"};
  Image out;
  out.width = static_cast<std::uint32_t>(image.cols);
  out.height = static_cast<std::uint32_t>(image.rows);
  out.channels = static_cast<std::uint32_t>(image.channels());
  out.bytes.assign(image.datastart, image.dataend);
  return out;
}

Result<Image> read_image(const std::string& path, std::uint64_t max_pixels) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(path, failed);
  if (failed)
    return Error{ErrorCode::kBadData, path, "no such image file",
                 "data.csv names files in the folder data beside it"};
  if (size > kMaxFileBytes)
    return Error{ErrorCode::kBadData, path, "larger than 64 MiB", "is this an image?"};
  std::vector<std::uint8_t> file(size);
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(file.data()), static_cast<std::streamsize>(size));
  if (!stream) return Error{ErrorCode::kBadData, path, "cannot be read", "check permissions"};
  return decode_image(file, path, max_pixels);
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
