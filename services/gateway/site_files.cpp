// SPDX-License-Identifier: Apache-2.0
#include "gateway/site_files.hpp"

#include <filesystem>

#include "base/read_file.hpp"

namespace crane::gateway {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kMostBytes = 64U << 20U;

const char* type_of(const fs::path& file) {
  const std::string e = file.extension();
  if (e == ".html") return "text/html; charset=utf-8";
  if (e == ".js") return "text/javascript; charset=utf-8";
  if (e == ".css") return "text/css; charset=utf-8";
  if (e == ".svg") return "image/svg+xml";
  if (e == ".json") return "application/json";
  return "application/octet-stream";
}

}  // namespace

Result<std::map<std::string, http::Response>> read_site_files(const std::string& folder) {
  std::map<std::string, http::Response> out;
  std::error_code failed;
  const auto there = is_folder(folder);
  if (!there) return there.error();
  if (!*there)
    return Error{ErrorCode::kNotAvailable, folder, "has no page",
                 "build with CRANEMAP_GATEWAY_PAGE=ON, or name its folder with --page"};
  std::uint64_t bytes = 0;
  fs::recursive_directory_iterator at(folder, failed);
  for (; !failed && at != fs::recursive_directory_iterator(); at.increment(failed)) {
    if (!at->is_regular_file(failed)) continue;
    auto content = read_file(at->path(), kMostBytes - bytes);
    if (!content) return content.error();
    bytes += content->size();
    std::string path = "/" + at->path().lexically_relative(folder).generic_string();
    http::Response response{200, std::move(*content), type_of(at->path())};
    // Named by what is in them.
    if (path.starts_with("/assets/"))
      response.headers.emplace_back("Cache-Control", "private, max-age=31536000, immutable");
    if (path == "/index.html") out["/"] = response;
    out[std::move(path)] = std::move(response);
  }
  if (failed) return Error{ErrorCode::kResource, folder, "cannot be read: " + failed.message(), ""};
  return out;
}

}  // namespace crane::gateway
