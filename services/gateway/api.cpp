// SPDX-License-Identifier: Apache-2.0
#include "gateway/api.hpp"

#include "gateway/height_files.hpp"
#include "gateway/json.hpp"
#include "gateway/map_feed.hpp"
#include "http/query.hpp"

namespace crane::gateway {
namespace {

/// Questions that are thought about at a time: the others' threads are for short answers.
constexpr int kMostThinking = 2;

http::Response json(int status, const Json& body) {
  return {status, text_of(body), "application/json"};
}

http::Response problem(int status, const std::string& what) {
  return json(status, {{"error", what}});
}

/// One of those who think, while there is room.
class Thinker {
 public:
  explicit Thinker(std::atomic<int>& count) : count_(count), in_(++count <= kMostThinking) {}
  ~Thinker() { --count_; }
  Thinker(const Thinker&) = delete;
  Thinker& operator=(const Thinker&) = delete;
  explicit operator bool() const { return in_; }

 private:
  std::atomic<int>& count_;
  bool in_;
};

http::Response busy() {
  http::Response out = problem(503, "busy with other questions: ask again in a second");
  out.headers.emplace_back("Retry-After", "1");
  return out;
}

}  // namespace

void Api::add_routes(http::Router& router) {
  const std::string base = "/api/v1/";
  router.get(base + "status", [this](const auto&) { return status(); });
  router.get(base + "height", [this](const auto& r) { return height(r); });
  router.get(base + "zones", [this](const auto&) { return zones(); });
  router.post(base + "clearance", [this](const auto& r) { return clearance(r); });
  for (const char* kind : {"json", "csv", "png", "pgw"})
    router.get(base + "heights." + kind, [this, kind](const auto&) { return heights(kind); });
  router.get(base + "heights", [this](const auto&) { return heights("json"); });
  for (const char* kind : {"bt", "ot", "pcd", "ply"})
    router.get(base + "map." + kind, [this, kind](const auto& r) { return file(kind, r); });
  router.stream(base + "stream",
                [this](const auto&) { return std::make_unique<MapFeed>(board_, tiles_); });
}

http::Response Api::status() const {
  const auto said = board_.now();
  if (said.number == 0) return problem(503, "starting");
  return {200, *said.json, "application/json"};
}

http::Response Api::height(const http::Request& request) const {
  const auto query = http::parse_query(request.query());
  std::optional<double> at[2];
  if (query && query->size() == 2)
    for (int i = 0; i < 2; ++i)
      if (const auto found = query->find(i == 0 ? "x" : "y"); found != query->end())
        at[i] = http::parse_number(found->second);
  if (!at[0] || !at[1]) return problem(400, "ask for height?x=METRES&y=METRES");
  const TimeNs now = SystemClock().now();
  Json out = to_json(map_.height(*at[0], *at[1]), now);
  out["x_m"] = *at[0];
  out["y_m"] = *at[1];
  out["map"] = to_json(map_.status(), now);
  return json(200, out);
}

http::Response Api::heights(const std::string& kind) const {
  const client::Status status = map_.status();
  const client::HeightGrid grid = map_.heights();
  const TimeNs now = SystemClock().now();
  if (kind == "csv") return {200, heights_csv(grid, now), "text/csv; charset=utf-8"};
  if (kind == "pgw") return {200, heights_world_file(grid)};
  if (kind == "json") {
    std::string map = text_of(to_json(status, now));
    map.pop_back();
    return {200, heights_json(grid, map, now), "application/json"};
  }
  auto png = heights_png(grid);
  if (!png) return problem(503, png.error().text());
  return {200, std::move(*png), "image/png"};
}

http::Response Api::clearance(const http::Request& request) {
  const auto query = parse_clearance(request.body);
  if (!query) return problem(400, query.error().text());
  const Thinker thinker(thinking_);
  if (!thinker) return busy();
  return json(200, to_json(map_.clearance(*query)));
}

http::Response Api::zones() const {
  Json all = Json::array();
  for (const client::Zone& z : map_.zones()) all.push_back(to_json(z));
  return json(200,
              {{"zones", std::move(all)}, {"map", to_json(map_.status(), SystemClock().now())}});
}

http::Response Api::file(const std::string& kind, const http::Request& request) {
  const client::Status s = map_.status();
  if (!(s.valid && s.complete) && request.query() != "even_invalid=1")
    return problem(503, "the map is not " + std::string(s.valid ? "complete here" : "valid: ") +
                            s.reason + "; with ?even_invalid=1 it is served all the same");
  const Thinker thinker(thinking_);
  if (!thinker) return busy();
  auto made = files_.get(kind);
  if (!made) return problem(503, made.error().text());
  return {200,
          std::move(*made),
          "application/octet-stream",
          {{"Content-Disposition", "attachment; filename=\"map." + kind + "\""}}};
}

}  // namespace crane::gateway
