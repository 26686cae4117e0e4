// SPDX-License-Identifier: Apache-2.0
#include "imaging/jpeg.hpp"

#include <csetjmp>
#include <cstddef>
#include <cstdio>

// jpeglib.h needs cstdio before it.
#include <jpeglib.h>

#include <jerror.h>

namespace crane {
namespace {

/// No encoder writes so many; each one costs a pass over the image.
constexpr int kMostScans = 100;

/// What libjpeg says, first of all what it repairs in silence.
struct Said {
  jpeg_error_mgr errors{};
  jpeg_progress_mgr progress{};
  std::jmp_buf give_up;
  bool damaged = false;
  char text[JMSG_LENGTH_MAX] = "";
};

Said& said_of(j_common_ptr jpeg) {
  return *static_cast<Said*>(jpeg->client_data);
}

[[noreturn]] void give_up(j_common_ptr jpeg) {
  Said& said = said_of(jpeg);
  jpeg->err->format_message(jpeg, said.text);
  std::longjmp(said.give_up, 1);  // NOLINT: as libjpeg asks for; only trivial objects are skipped
}

void note(j_common_ptr jpeg, int level) {
  // Bytes that no marker needs are padding; every other warning is of pixels that are made up.
  if (level >= 0 || jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA) return;
  Said& said = said_of(jpeg);
  if (!said.damaged) jpeg->err->format_message(jpeg, said.text);
  said.damaged = true;
}

void count_scans(j_common_ptr jpeg) {
  if (reinterpret_cast<j_decompress_ptr>(jpeg)->input_scan_number > kMostScans)
    ERREXIT(jpeg, JERR_BAD_PROGRESSION);
}

/// Of a progressive image: whether its last scans came.
bool is_refined(const jpeg_decompress_struct& jpeg) {
  if (jpeg.coef_bits == nullptr) return true;
  for (int c = 0; c < jpeg.num_components; ++c)
    for (int i = 0; i < DCTSIZE2; ++i)
      if (jpeg.coef_bits[c][i] != 0) return false;
  return true;
}

enum class Outcome { kDone, kTooLarge, kNotGreyOrColour, kNotRefined, kGaveUp };

/// Nothing here has a destructor that a jump would leave out; `out` is the caller's.
Outcome decode(jpeg_decompress_struct& jpeg, Said& said, std::span<const std::uint8_t> file,
               std::uint64_t max_pixels, Image& out) {
  if (setjmp(said.give_up) != 0) return Outcome::kGaveUp;  // NOLINT
  jpeg_create_decompress(&jpeg);
  jpeg.client_data = &said;
  said.progress.progress_monitor = count_scans;
  jpeg.progress = &said.progress;
  jpeg_mem_src(&jpeg, file.data(), file.size());
  jpeg_read_header(&jpeg, TRUE);
  out.width = jpeg.image_width;
  out.height = jpeg.image_height;
  if (std::uint64_t{jpeg.image_width} * jpeg.image_height > max_pixels) return Outcome::kTooLarge;
  if (jpeg.num_components != 1 && jpeg.num_components != 3) return Outcome::kNotGreyOrColour;
  jpeg.out_color_space = jpeg.num_components == 1 ? JCS_GRAYSCALE : JCS_EXT_BGR;
  jpeg_start_decompress(&jpeg);
  out.channels = static_cast<std::uint32_t>(jpeg.output_components);
  const std::size_t row_bytes = std::size_t{out.width} * out.channels;
  out.bytes.resize(row_bytes * out.height);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW row = out.bytes.data() + row_bytes * jpeg.output_scanline;
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  const bool refined = is_refined(jpeg);
  jpeg_finish_decompress(&jpeg);  // reads on to the end marker
  return refined ? Outcome::kDone : Outcome::kNotRefined;
}

}  // namespace

Error too_many_pixels(const std::string& name, std::uint64_t width, std::uint64_t height,
                      std::uint64_t max_pixels) {
  return {ErrorCode::kBadData, name,
          std::to_string(width) + " x " + std::to_string(height) + " pixels; at most " +
              std::to_string(max_pixels) + " pixels fit a stereo frame",
          "set the camera to 2448 x 2048 or less"};
}

bool is_jpeg(std::span<const std::uint8_t> file) {
  return file.size() > 4 && file[0] == 0xFF && file[1] == 0xD8;
}

Result<Image> decode_jpeg(std::span<const std::uint8_t> file, const std::string& name,
                          std::uint64_t max_pixels) {
  Said said;
  jpeg_decompress_struct jpeg{};
  jpeg.err = jpeg_std_error(&said.errors);
  said.errors.error_exit = give_up;
  said.errors.emit_message = note;
  jpeg.client_data = &said;
  Image out;
  const Outcome outcome = decode(jpeg, said, file, max_pixels, out);
  jpeg_destroy_decompress(&jpeg);
  const auto bad = [&name](std::string what, std::string todo) {
    return Error{ErrorCode::kBadData, name, std::move(what), std::move(todo)};
  };
  switch (outcome) {
    case Outcome::kTooLarge:
      return too_many_pixels(name, out.width, out.height, max_pixels);
    case Outcome::kNotGreyOrColour:
      return bad("is not an 8-bit grey or colour image", "convert it to 8-bit PNG or JPEG");
    case Outcome::kGaveUp:
      return bad(std::string("cannot be decoded: ") + said.text,
                 "record it again, as 8-bit PNG or JPEG");
    case Outcome::kNotRefined:
      return bad("is not complete: its last scans are missing",
                 "record it again or remove its line from data.csv");
    case Outcome::kDone:
      break;
  }
  if (said.damaged)
    return bad(std::string("is not complete (truncated or damaged): ") + said.text,
               "record it again or remove its line from data.csv");
  return out;
}

}  // namespace crane
