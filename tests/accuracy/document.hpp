// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace crane::accuracy {

using Row = std::vector<std::string>;

/// A value at each label of the x axis; a value <= 0 leaves a gap on a logarithmic axis.
struct Line {
  std::string name;
  std::vector<double> values;
};

struct Plot {
  std::string title, x_axis, y_axis;
  std::vector<std::string> labels;
  std::vector<Line> lines;
  double limit = 0;  ///< dashed; 0 = none
};

/// A report that grows part by part and is written as one HTML page and as Markdown.
class Document {
 public:
  /// `folder` takes report.html, report.md and the pictures beside them.
  Document(std::string folder, std::string title);

  void section(const std::string& title);
  void text(const std::string& paragraph);
  void table(const Row& header, const std::vector<Row>& rows);
  /// On a logarithmic axis: what is compared differs by a factor of a hundred.
  void plot(const Plot& plot);
  /// `file` lies in the folder already.
  void picture(const std::string& file, const std::string& caption);
  /// Several beside each other: file and caption.
  void pictures(const std::vector<std::pair<std::string, std::string>>& row);

  [[nodiscard]] const std::string& folder() const { return folder_; }
  /// Error: Resource.
  [[nodiscard]] Result<void> write() const;

 private:
  std::string folder_, title_;
  std::string html_, markdown_;
  int plots_ = 0;
  std::vector<std::pair<std::string, std::string>> files_;  ///< plots: name and content
};

std::string fixed(double value, int digits);

}  // namespace crane::accuracy
