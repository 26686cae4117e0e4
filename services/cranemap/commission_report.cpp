// SPDX-License-Identifier: Apache-2.0
#include "base/format.hpp"
#include "base/write_file.hpp"
#include "calibration/escaped.hpp"
#include "commission_items.hpp"

namespace crane {
namespace {

constexpr const char* kStyle = R"(
:root{--ink:#1c2733;--soft:#5b6b7a;--line:#d4dbe2;--good:#1f6f43;--bad:#b3261e;--warn:#b26a00}
*{box-sizing:border-box}body{font:15px/1.5 system-ui,sans-serif;color:var(--ink);background:#fff;margin:0 auto;max-width:960px;padding:28px}
h1{font-size:26px;margin:0}h2{font-size:18px;margin:30px 0 6px;border-bottom:1px solid var(--line);padding-bottom:4px}
.sub{color:var(--soft);margin:2px 0 18px}.verdict{border:2px solid var(--good);border-radius:6px;padding:12px 18px;font-size:18px;font-weight:600}
.verdict small{display:block;font-weight:400;font-size:14px}.verdict.failed{border-color:var(--bad)}.verdict.open{border-color:var(--soft)}
table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:5px 12px 5px 0;border-bottom:1px solid var(--line);vertical-align:top}
th{font-weight:600}.passed,.good{color:var(--good)}.failed,.bad{color:var(--bad);font-weight:600}.warning{color:var(--warn)}.open{color:var(--soft)}
td.state{white-space:nowrap;width:1%}.advice{display:block;color:var(--ink);font-weight:400}.advice::before{content:'\2192\00a0'}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(300px,1fr));gap:16px;margin-top:12px}
figure{margin:0}img{max-width:100%;border:1px solid var(--line)}figcaption{color:var(--soft);font-size:13px}
.sign{margin-top:48px;display:grid;grid-template-columns:1fr 1fr;gap:40px}.sign div{border-top:1px solid var(--ink);padding-top:4px;color:var(--soft)}
@media print{body{padding:0;max-width:none}h2{break-after:avoid}figure,tr{break-inside:avoid}})";

constexpr const char* kState[] = {"open", "passed", "failed"};
constexpr const char* kStateWords[] = {"not done", "passed", "failed"};
constexpr const char* kVerdict[] = {"good", "warning", "bad"};
constexpr const char* kVerdictWords[] = {"good", "note", "bad"};

std::string section(const CommissionItem& item) {
  std::string out = "<h2>" + escaped(item.title) + "</h2><table>";
  for (const Finding& f : item.findings) {
    const auto v = static_cast<std::size_t>(f.verdict);
    out += formatted("<tr><td class='state %s'>%s</td><td>", kVerdict[v], kVerdictWords[v]) +
           escaped(f.what) + "</td><td>" + escaped(f.text);
    if (!f.advice.empty()) out += "<span class='advice'>" + escaped(f.advice) + "</span>";
    out += "</td></tr>";
  }
  out += "</table><div class='pictures'>";
  for (const auto& p : item.pictures) {
    const std::string file = escaped(p.file);
    if (p.file.ends_with(".html"))
      out += "<p><a href='" + file + "'>" + escaped(p.caption) + "</a></p>";
    else
      out += "<figure><img src='" + file + "' alt=''><figcaption>" + escaped(p.caption) +
             "</figcaption></figure>";
  }
  return out + "</div>";
}

}  // namespace

Result<void> write_commission_report(const CommissionBook& book, const std::string& folder,
                                     int crane) {
  bool failed = false;
  std::string last;
  for (const CommissionItem& item : book.items()) {
    failed = failed || item.state == CommissionItem::State::kFailed;
    last = std::max(last, item.when);
  }
  const auto state = static_cast<std::size_t>(failed              ? CommissionItem::State::kFailed
                                              : book.all_passed() ? CommissionItem::State::kPassed
                                                                  : CommissionItem::State::kOpen);
  std::string todo;
  for (const CommissionItem& item : book.items())
    for (const Finding& f : item.findings)
      if (f.verdict == Finding::Verdict::kBad)
        todo += "<small>" + escaped(f.text) + " &rarr; " + escaped(f.advice) + "</small>";
  static constexpr const char* kWhole[] = {"Not finished", "Passed", "Failed"};
  std::string out = formatted(
      "<!doctype html><html lang='en'><head><meta charset='utf-8'><meta name='viewport' "
      "content='width=device-width'><title>Commissioning of crane %d</title><style>%s</style>"
      "</head><body><h1>Commissioning of crane %d</h1><p class='sub'>%s</p>"
      "<div class='verdict %s'>%s",
      crane, kStyle, crane, last.c_str(), kState[state], kWhole[state]);
  out += todo + "</div><h2>Items</h2><table>";
  for (const CommissionItem& item : book.items()) {
    const auto s = static_cast<std::size_t>(item.state);
    out += formatted("<tr><td class='state %s'>%s</td><td>", kState[s], kStateWords[s]) +
           escaped(item.title) + "</td><td>" + escaped(item.when) + "</td></tr>";
  }
  out += "</table>";
  for (const CommissionItem& item : book.items())
    if (item.state != CommissionItem::State::kOpen) out += section(item);
  out += "<div class='sign'><div>Technician, date</div><div>Operator, date</div></div>";
  out += "</body></html>\n";
  return write_file(folder + "/report.html", reinterpret_cast<const std::uint8_t*>(out.data()),
                    out.size());
}

}  // namespace crane
