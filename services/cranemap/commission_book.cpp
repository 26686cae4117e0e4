// SPDX-License-Identifier: Apache-2.0
#include "commission_book.hpp"

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>

#include "base/read_file.hpp"
#include "base/write_file.hpp"

namespace crane {
namespace {

using nlohmann::json;

constexpr const char* kStates[] = {"open", "passed", "failed"};
constexpr const char* kVerdicts[] = {"good", "warning", "bad"};
constexpr std::uint64_t kMostBytes = 4U << 20U;

struct Known {
  const char *name, *title;
};
constexpr Known kItems[] = {
    {"sensors", "Host, camera and rangefinders answer"},
    {"images", "Images: caps, light, focus, dirt, left and right"},
    {"calibration", "Calibration of the cameras"},
    {"drive", "Drive: mount of the camera, rangefinders of bridge and trolley"},
    {"map", "Test map with a known object"},
    {"hoist", "Hoist and load"},
    {"zones", "Zones"},
};

/// The index of a word; throws nlohmann's exception for one that is none.
template <std::size_t N>
int index_of(const char* const (&words)[N], const std::string& word) {
  for (std::size_t i = 0; i < N; ++i)
    if (word == words[i]) return static_cast<int>(i);
  throw json::other_error::create(501, "'" + word + "' is no state", nullptr);
}

json to_json(const CommissionItem& item) {
  json findings = json::array(), pictures = json::array();
  for (const Finding& f : item.findings)
    findings.push_back({{"verdict", kVerdicts[static_cast<int>(f.verdict)]},
                        {"what", f.what},
                        {"text", f.text},
                        {"advice", f.advice}});
  for (const auto& p : item.pictures)
    pictures.push_back({{"file", p.file}, {"caption", p.caption}});
  return {{"name", item.name},
          {"state", kStates[static_cast<int>(item.state)]},
          {"when", item.when},
          {"findings", findings},
          {"pictures", pictures}};
}

void read_item(const json& from, CommissionItem& item) {
  item.state =
      static_cast<CommissionItem::State>(index_of(kStates, from.at("state").get<std::string>()));
  item.when = from.at("when");
  for (const json& f : from.at("findings"))
    item.findings.push_back(
        {static_cast<Finding::Verdict>(index_of(kVerdicts, f.at("verdict").get<std::string>())),
         f.at("what"), f.at("text"), f.at("advice")});
  for (const json& p : from.at("pictures"))
    item.pictures.push_back({p.at("file"), p.at("caption")});
}

}  // namespace

void CommissionItem::good(const std::string& what, const std::string& text) {
  findings.push_back({Finding::Verdict::kGood, what, text, ""});
}
void CommissionItem::warning(const std::string& what, const std::string& text,
                             const std::string& advice) {
  findings.push_back({Finding::Verdict::kWarning, what, text, advice});
}
void CommissionItem::bad(const std::string& what, const std::string& text,
                         const std::string& advice) {
  findings.push_back({Finding::Verdict::kBad, what, text, advice});
}
bool CommissionItem::any_bad() const {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& f) { return f.verdict == Finding::Verdict::kBad; });
}

Result<CommissionBook> CommissionBook::open(const std::string& folder) {
  CommissionBook book(folder);
  for (const Known& known : kItems)
    book.items_.push_back({known.name, known.title, {}, "", {}, {}});
  const std::string path = folder + "/book.json";
  const auto there = is_there(path);
  if (!there) return there.error();
  if (!*there) return book;
  const auto text = read_file(path, kMostBytes);
  if (!text) return text.error();
  try {
    const json whole = json::parse(*text);
    for (const json& item : whole.at("items"))
      for (CommissionItem& known : book.items_)
        if (known.name == item.at("name").get<std::string>()) read_item(item, known);
  } catch (const json::exception& e) {
    return Error{ErrorCode::kConfiguration, path, std::string("is damaged: ") + e.what(),
                 "remove it; the items are gone through again"};
  }
  return book;
}

CommissionItem& CommissionBook::item(const std::string& name) {
  const auto found = std::find_if(items_.begin(), items_.end(),
                                  [&](const CommissionItem& i) { return i.name == name; });
  expects(found != items_.end(), "an item of the book");
  return *found;
}

void CommissionBook::close(CommissionItem& item) {
  item.state = item.any_bad() ? CommissionItem::State::kFailed : CommissionItem::State::kPassed;
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &utc);
  item.when = text;
}

bool CommissionBook::all_passed() const {
  return std::all_of(items_.begin(), items_.end(), [](const CommissionItem& i) {
    return i.state == CommissionItem::State::kPassed;
  });
}

Result<void> CommissionBook::save() const {
  json items = json::array();
  for (const CommissionItem& item : items_) items.push_back(to_json(item));
  const std::string text =
      json{{"items", items}}.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
  return write_file(folder_ + "/book.json", reinterpret_cast<const std::uint8_t*>(text.data()),
                    text.size());
}

}  // namespace crane
