// SPDX-License-Identifier: Apache-2.0
#include "service/decimal_options.hpp"

#include <CLI/CLI.hpp>
#include <string>

#include "config/yaml_strict.hpp"

namespace crane {
namespace {

/// Leading zeros go, so that CLI11 does not see an octal number.
std::string to_decimal(std::string& text) {
  const std::string sign =
      !text.empty() && (text[0] == '-' || text[0] == '+') ? text.substr(0, 1) : "";
  const std::string digits = text.substr(sign.size());
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos)
    return "'" + text + "' is no whole decimal number";
  const std::size_t first = digits.find_first_not_of('0');
  text = (sign == "-" ? sign : "") + (first == std::string::npos ? "0" : digits.substr(first));
  return "";
}

std::string check_decimal(std::string& text) {
  return decimal_number(text) ? "" : "'" + text + "' is no decimal number";
}

}  // namespace

void take_decimal_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    if (type.starts_with("INT") || type.starts_with("UINT"))
      option->transform(CLI::Validator(to_decimal, ""));
    else if (type.starts_with("FLOAT"))
      option->transform(CLI::Validator(check_decimal, ""));
  }
  for (CLI::App* sub : app.get_subcommands([](CLI::App*) { return true; }))
    take_decimal_numbers(*sub);
}

}  // namespace crane
