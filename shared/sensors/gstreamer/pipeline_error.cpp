// SPDX-License-Identifier: Apache-2.0
#include "sensors/gstreamer/pipeline_error.hpp"

#include <cstring>
#include <string>

namespace crane {
namespace {

constexpr const char* kName = "camera.pipeline";

/// In the last line of the debug text stands what the element itself knows; before it, its source.
std::string own_words(const char* debug) {
  const char* line = debug == nullptr ? nullptr : std::strrchr(debug, '\n');
  return line == nullptr || line[1] == '\0' ? "" : std::string(" (") + (line + 1) + ")";
}

struct Advice {
  GQuark domain;
  int code;
  ErrorCode kind;
  const char* todo;
};

/// What people can do about the errors they will meet.
Advice advice_for(const GError* error) {
  const Advice table[] = {
      {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_FOUND, ErrorCode::kNotAvailable,
       "is the camera on, and its address or device right?"},
      {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_OPEN_READ, ErrorCode::kNotAvailable,
       "is the camera on, reachable, and may this user read it (group video)?"},
      {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_OPEN_READ_WRITE, ErrorCode::kNotAvailable,
       "is the camera on, reachable, and may this user read it (group video)?"},
      {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_READ, ErrorCode::kNotAvailable,
       "was the camera unplugged or switched off?"},
      {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_BUSY, ErrorCode::kResource,
       "another program uses the camera: end it"},
      {GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NOT_AUTHORIZED, ErrorCode::kResource,
       "give user-id and user-pw to the source"},
      {GST_CORE_ERROR, GST_CORE_ERROR_MISSING_PLUGIN, ErrorCode::kResource,
       "install the package that has it: gstreamer1.0-plugins-good, -bad, gstreamer1.0-libav"},
      {GST_STREAM_ERROR, GST_STREAM_ERROR_CODEC_NOT_FOUND, ErrorCode::kResource,
       "install a decoder for it: gstreamer1.0-libav"},
      {GST_STREAM_ERROR, GST_STREAM_ERROR_WRONG_TYPE, ErrorCode::kResource,
       "put a decoder and videoconvert before appsink"},
      {GST_STREAM_ERROR, GST_STREAM_ERROR_FAILED, ErrorCode::kResource,
       "appsink takes GRAY8, BGR, RGB, YUY2 and UYVY: put videoconvert before it; try the pipeline "
       "with gst-launch-1.0 -v"},
  };
  for (const Advice& row : table)
    if (error->domain == row.domain && error->code == row.code) return row;
  return {0, 0, ErrorCode::kResource, "try the pipeline with gst-launch-1.0 -v"};
}

}  // namespace

Error pipeline_error(GstMessage* message) {
  GError* error = nullptr;
  gchar* debug = nullptr;
  gst_message_parse_error(message, &error, &debug);
  const Advice advice = advice_for(error);
  Error out{advice.kind, kName,
            std::string("element ") + GST_OBJECT_NAME(GST_MESSAGE_SRC(message)) + ": " +
                error->message + own_words(debug),
            advice.todo};
  g_error_free(error);
  g_free(debug);
  return out;
}

Error parse_error(const GError* error) {
  const std::string what = error == nullptr ? "nothing is said why" : error->message;
  if (error != nullptr && error->domain == GST_PARSE_ERROR &&
      error->code == GST_PARSE_ERROR_NO_SUCH_ELEMENT)
    return {ErrorCode::kConfiguration, kName, what,
            "install the package that has it: gstreamer1.0-plugins-good, -bad, gstreamer1.0-libav; "
            "gst-inspect-1.0 lists what is there"};
  return {ErrorCode::kConfiguration, kName, "is no pipeline: " + what,
          "try it with gst-launch-1.0"};
}

}  // namespace crane
