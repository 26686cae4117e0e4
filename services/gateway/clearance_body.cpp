// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <initializer_list>

#include "bounds.h"
#include "gateway/json.hpp"

namespace crane::gateway {
namespace {

/// Takes the members of one object; says what is wrong with the first that is.
class Members {
 public:
  Members(const Json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) wrong_ = where_ + " must be an object";
  }

  void number(const char* key, double& out, bool needed = false) {
    const Json* value = member(key, needed);
    if (value == nullptr) return;
    if (!value->is_number() || !std::isfinite(value->get<double>()))
      return say(key, "must be a number");
    out = value->get<double>();
  }
  /// nullptr: not there.
  const Json* member(const char* key, bool needed = false) {
    if (!wrong_.empty()) return nullptr;
    const auto found = object_.find(key);
    if (found != object_.end()) return ++found_, &*found;
    if (needed) say(key, "is missing");
    return nullptr;
  }
  void say(const char* key, const char* what) {
    if (wrong_.empty()) wrong_ = where_ + (where_.empty() ? "" : ".") + key + " " + what;
  }
  /// What is wrong; empty: nothing. After all members were asked for.
  [[nodiscard]] std::string wrong() const {
    if (wrong_.empty() && object_.is_object() && object_.size() > found_)
      return (where_.empty() ? "the question" : where_) +
             " has a key that is not known: see /api/v1/openapi.json";
    return wrong_;
  }

 private:
  const Json& object_;
  std::string where_, wrong_;
  std::size_t found_ = 0;
};

Error bad(const std::string& what) {
  return {ErrorCode::kBadData, "clearance", what, "see /api/v1/openapi.json"};
}

}  // namespace

Result<client::ClearanceQuery> parse_clearance(std::string_view body) {
  // Its depth is what a recursive parser must not be asked for.
  int depth = 0;
  for (const char c : body) {
    depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    if (depth > 8) return bad("is nested too deep");
  }
  const Json json = Json::parse(body, nullptr, false);
  if (json.is_discarded()) return bad("is no JSON");
  client::ClearanceQuery q;
  Members all(json, "");
  const Json* path = all.member("path", true);
  if (path != nullptr && (!path->is_array() || path->empty()))
    all.say("path", "must be a list of poses");
  else if (path != nullptr && path->size() > v1::MAX_PATH_POSES)
    all.say("path", "has more than 256 poses");
  else if (path != nullptr)
    for (std::size_t i = 0; i < path->size(); ++i) {
      Members m((*path)[i], "path[" + std::to_string(i) + "]");
      client::Pose p;
      m.number("x_m", p.x_m, true);
      m.number("y_m", p.y_m, true);
      m.number("z_m", p.z_m, true);
      m.number("yaw_rad", p.yaw_rad);
      if (const std::string wrong = m.wrong(); !wrong.empty()) return bad(wrong);
      q.path.push_back(p);
    }
  if (const Json* load = all.member("load")) {
    Members m(*load, "load");
    m.number("size_x_m", q.load.size_x_m);
    m.number("size_y_m", q.load.size_y_m);
    m.number("size_z_m", q.load.size_z_m);
    m.number("above_m", q.load.above_m);
    if (const std::string wrong = m.wrong(); !wrong.empty()) return bad(wrong);
  }
  if (const Json* margins = all.member("margins")) {
    Members m(*margins, "margins");
    m.number("horizontal_m", q.margins.horizontal_m);
    m.number("vertical_m", q.margins.vertical_m);
    m.number("sway_m", q.margins.sway_m);
    m.number("braking_m", q.margins.braking_m);
    if (const std::string wrong = m.wrong(); !wrong.empty()) return bad(wrong);
  }
  all.number("max_age_s", q.max_age_s);
  double views = q.min_views;
  all.number("min_views", views);
  if (!(views >= 0 && views <= 32 && views == std::floor(views)))
    all.say("min_views", "must be a whole number from 0 to 32");
  if (const std::string wrong = all.wrong(); !wrong.empty()) return bad(wrong);
  q.min_views = static_cast<std::uint32_t>(views);
  return q;
}

}  // namespace crane::gateway
