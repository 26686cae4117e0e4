// SPDX-License-Identifier: Apache-2.0
#include "document.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "plot.hpp"

namespace crane::accuracy {
namespace {

constexpr const char* kStyle =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:68em;margin:2em auto;padding:0 "
    "1em;color:#222}"
    "h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid #ddd}"
    "table{border-collapse:collapse;margin:1em 0}td,th{padding:.25em .8em;border-bottom:1px solid "
    "#e4e4e4;text-align:right}td:first-child,th:first-child{text-align:left}th{background:#f6f6f6}"
    "figure{display:inline-block;margin:.5em 1em .5em 0;max-width:100%;vertical-align:top}"
    "img{max-width:100%}figure.part{width:31%}figcaption{color:#555;font-size:.9em}";

std::string escape(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

Result<void> write_text(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::trunc);
  file << text;
  file.close();
  if (!file)
    return Error{ErrorCode::kResource, path, "cannot be written",
                 "check permissions and free space"};
  return {};
}

}  // namespace

std::string fixed(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

Document::Document(std::string folder, std::string title)
    : folder_(std::move(folder)), title_(std::move(title)) {
  html_ = "<h1>" + escape(title_) + "</h1>\n";
  markdown_ = "# " + title_ + "\n\n";
}

void Document::section(const std::string& title) {
  html_ += "<h2>" + escape(title) + "</h2>\n";
  markdown_ += "## " + title + "\n\n";
}

void Document::text(const std::string& paragraph) {
  html_ += "<p>" + escape(paragraph) + "</p>\n";
  markdown_ += paragraph + "\n\n";
}

void Document::table(const Row& header, const std::vector<Row>& rows) {
  html_ += "<table>\n<tr>";
  markdown_ += "|";
  std::string rule = "|";
  for (const std::string& cell : header) {
    html_ += "<th>" + escape(cell) + "</th>";
    markdown_ += " " + cell + " |";
    rule += rule.size() == 1 ? "---|" : "---:|";
  }
  html_ += "</tr>\n";
  markdown_ += "\n" + rule + "\n";
  for (const Row& row : rows) {
    html_ += "<tr>";
    markdown_ += "|";
    for (const std::string& cell : row) {
      html_ += "<td>" + escape(cell) + "</td>";
      markdown_ += " " + cell + " |";
    }
    html_ += "</tr>\n";
    markdown_ += "\n";
  }
  html_ += "</table>\n";
  markdown_ += "\n";
}

void Document::plot(const Plot& plot) {
  const std::string name = "plot_" + std::to_string(++plots_) + ".svg";
  const std::string svg = to_svg(plot);
  files_.emplace_back(name, svg);
  html_ += "<figure>" + svg + "</figure>\n";
  markdown_ += "![" + plot.title + "](" + name + ")\n\n";
}

void Document::picture(const std::string& file, const std::string& caption) {
  html_ += "<figure><img src=\"" + file + "\" alt=\"\"><figcaption>" + escape(caption) +
           "</figcaption></figure>\n";
  markdown_ += "![" + caption + "](" + file + ")\n\n";
}

void Document::pictures(const std::vector<std::pair<std::string, std::string>>& row) {
  for (const auto& [file, caption] : row) {
    html_ += "<figure class=\"part\"><img src=\"" + file + "\" alt=\"\"><figcaption>" +
             escape(caption) + "</figcaption></figure>\n";
    markdown_ += "![" + caption + "](" + file + ")\n";
  }
  markdown_ += "\n";
}

Result<void> Document::write() const {
  std::error_code failed;
  std::filesystem::create_directories(folder_, failed);
  for (const auto& [name, content] : files_)
    if (auto done = write_text(folder_ + "/" + name, content); !done) return done;
  if (auto done = write_text(folder_ + "/report.md", markdown_); !done) return done;
  return write_text(folder_ + "/report.html",
                    "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                        escape(title_) + "</title><style>" + kStyle + "</style></head><body>\n" +
                        html_ + "</body></html>\n");
}

}  // namespace crane::accuracy
